"""From a trip code to a verdict."""

from __future__ import annotations

import numpy as np

from alight.control.law import Law
from alight.simulation.closed_loop import NO_TORQUE, PLANT, TRIPS
from alight.simulation.verdict import Outcome, Verdict


def ending(code: int, end: float, law: Law, plant: np.ndarray) -> Verdict:
    """How a run ended.

    Parameters
    ----------
    code : int
        Trip code of its last tick; 0 where it ran to its end.
    end : float
        Time of that tick [s].
    law : Law
        Tells what its own codes mean.
    plant : (7,) array
        State of the plant after that tick.
    """
    if not code:
        return Verdict(Outcome.COMPLETED, end)
    if code in law.trips:
        signal = "u_f" if "u_f" in law.states else None
        return Verdict(Outcome.TRIPPED, end, signal, law.trips[code])
    if code == NO_TORQUE:
        return Verdict(Outcome.NOT_FINITE, end, "tau", TRIPS[code])
    # under a torque that is a number nothing but divergence makes the plant none
    size = np.where(np.isfinite(plant), np.abs(plant), np.inf)
    return Verdict(Outcome.DIVERGED, end, PLANT.columns[int(np.argmax(size))], TRIPS[code])
