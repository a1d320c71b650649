"""Recordings of the live bench once more: on the page, and in simulation."""

from alight.live.replay.resimulate import Difference, first_difference, resimulate
from alight.live.replay.source import ReplaySource

__all__ = ["Difference", "ReplaySource", "first_difference", "resimulate"]
