"""The closed loop in time: one run, its recording, its verdict."""

from alight.simulation.closed_loop import ClosedLoop, InitialState
from alight.simulation.controller import Controller
from alight.simulation.recording import Recording
from alight.simulation.reference import Reference, reference
from alight.simulation.run import run
from alight.simulation.verdict import Outcome, Verdict

__all__ = [
    "ClosedLoop",
    "Controller",
    "InitialState",
    "Outcome",
    "Recording",
    "Reference",
    "Verdict",
    "reference",
    "run",
]
