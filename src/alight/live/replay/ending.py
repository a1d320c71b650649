"""How a run on the bench ended, as its recording says it."""

from __future__ import annotations

from alight.live.bank import Bank
from alight.live.cycle import HOST_TRIPS
from alight.live.seat import NOT_FINITE
from alight.live.shared.status import State
from alight.simulation.closed_loop import TRIPS
from alight.simulation.law_tick import LAW_TRIPS
from alight.simulation.verdict import Outcome, Verdict


def verdict_of(state: State, code: int, reason: str, end: float, bank: Bank, law: int) -> Verdict:
    """The verdict on a run.

    Parameters
    ----------
    state, code : State, int
        State and code of the trip in its last row.
    reason : str
        What the host said of a trip.
    end : float
        When the motors went without torque, or the last row was [s].
    bank, law : Bank, int
        Tell what the codes of the law in force mean.
    """
    if state is State.TRIPPED:
        if code in bank.loops[law].law.trips:
            outcome = Outcome.TRIPPED
        elif code == NOT_FINITE or code in LAW_TRIPS:
            outcome = Outcome.NOT_FINITE
        else:
            outcome = Outcome.HALTED
        return Verdict(outcome, end, None, reason or reason_of(code, bank, law))
    return Verdict(Outcome.STOPPED, end, None, "stopped")


def reason_of(code: int, bank: Bank, law: int) -> str:
    """What the code of a trip means, where the host's own words are not to be had."""
    known = {**TRIPS, **LAW_TRIPS, **HOST_TRIPS, **bank.loops[law].law.trips}
    return known.get(code, f"trip {code}")
