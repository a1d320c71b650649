"""Searches that try to break each proposition, and report their best attempt."""

from alight.theory.falsification.attempt import Attempt
from alight.theory.falsification.claims import Claims
from alight.theory.falsification.falsify import PROPOSITIONS, falsify
from alight.theory.falsification.report import markdown

__all__ = ["PROPOSITIONS", "Attempt", "Claims", "falsify", "markdown"]
