"""What a row of telemetry holds: the host's own columns, then those of device and laws."""

from __future__ import annotations

from collections.abc import Mapping

from alight.live.bank import Bank
from alight.simulation.closed_loop import MEASURED_SIGNALS
from alight.symbolic.signals import Layout, Signal

HOST_SIGNALS = {
    "t": Signal("s", "time since the start of the run: ticks times the sample time"),
    "wall": Signal("s", "when the tick began, on the clock time.monotonic"),
    "late": Signal("s", "how much later than its deadline the tick began"),
    "busy": Signal("s", "how long the tick before took, its telemetry included"),
    "missed": Signal("", "deadlines missed since the host began"),
    "state": Signal("", "0 ready, 1 running, 2 stopped, 3 tripped"),
    "trip": Signal("", "code of the trip, 0 without one"),
    "law": Signal("", "number of the law that is in force"),
    "command": Signal("", "number of the last command dealt with"),
    "kick": Signal("N m", "torque added to that of the law, by hand", 2),
}
TORQUES = {
    "tau": Signal("N m", "torque computed by the law", 2),
    "torque": Signal("N m", "torque sent to the motors: kicked, clipped, zero after a trip", 2),
}
WATCHED = {"V_r": Signal("J", "robot part of the Lyapunov function (47), Proposition A")}


def telemetry_layout(bank: Bank, device: Mapping[str, Signal]) -> Layout:
    """Layout of a row of telemetry; a column that the law in force does not have is NaN.

    Parameters
    ----------
    bank : Bank
        The laws: their signals, and their state before the tick.
    device : mapping
        The signals of the device.
    """
    laws: dict[str, Signal] = {}
    for loop in bank.loops:
        laws |= {**loop.law.signals, **loop.law.states}
    return Layout({**HOST_SIGNALS, **MEASURED_SIGNALS, **device, **TORQUES, **laws, **WATCHED})
