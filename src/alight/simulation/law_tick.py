"""The tick of a law alone, as a function of readings: what runs on a controller."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca

from alight.simulation.closed_loop import (
    MEASURED_SIGNALS,
    NO_TORQUE,
    SENSORS,
    TRIPS,
    ClosedLoop,
)
from alight.symbolic.build import build
from alight.symbolic.ops import Scalar, as_expression, fabs, where
from alight.symbolic.parameters import lift
from alight.symbolic.signals import Layout, Signal
from alight.testbed import SensorState

NO_READING = 103
LAW_TRIPS = {
    NO_READING: "a reading is infinite or not a number",
    NO_TORQUE: TRIPS[NO_TORQUE],
}
LARGEST = 1e300
"""Beyond this a number is as good as infinite."""

OUTPUTS = {
    "torque": Signal("N m", "torque for the motors: clipped, and zero after a trip", 2),
    "tau": Signal("N m", "torque computed by the law", 2),
}


@dataclass(frozen=True)
class LawTick:
    """The function ``(readings, state, parameters) -> (next state, outputs)``, and its names.

    The readings are those of `SensorState`. The state ends with the code of the trip that has
    stopped the law, 0 before.
    """

    function: ca.Function
    state: Layout
    outputs: Layout
    used: tuple[bool, ...]
    """For each parameter whether anything depends on it."""


def law_tick(loop: ClosedLoop) -> LawTick:
    """Build the tick of a closed loop's law: measurement, law, clip, trips.

    At the first sample, when there is no previous reading, velocities are zero. From the sample
    at which the law trips, or a reading or torque is no number, the torque is zero and the state
    stays what it was.
    """
    lifted = {name: lift(part, f"{name}.") for name, part in law_parameters(loop).items()}
    testbed, law = lifted["testbed"].obj, lifted["law"].obj if "law" in lifted else loop.law
    p = ca.vertcat(*(part.symbols for part in lifted.values()))
    state = Layout(
        {
            **{f"{name}_before": signal for name, signal in SENSORS.signals.items()},
            **loop.law_layout.signals,
            "trip": Signal("", "code of the trip that has stopped the law, 0 before"),
        }
    )
    u, x = ca.SX.sym("readings", SENSORS.size), ca.SX.sym("state", state.size)
    before, memory, stopped = x[: SENSORS.size], x[SENSORS.size : -1], x[-1]
    known = where(_are_numbers(before) > 0, before, u)
    measured = testbed.measure(
        SensorState(**SENSORS.unpack(u)), SensorState(**SENSORS.unpack(known))
    )
    tick = law.tick(loop.law_layout.unpack(memory), measured, 1 / testbed.sample_rate)

    now = where(_all_numbers(u) > 0, where(tick.trip > 0, tick.trip, 0.0), float(NO_READING))
    lost = where(_all_numbers(as_expression(tick.tau)) > 0, 0.0, float(NO_TORQUE))
    trip = where(stopped > 0, stopped, where(now > 0, now, lost))
    following = ca.vertcat(u, loop.law_layout.pack(dict(tick.state)))
    outputs = Layout({**OUTPUTS, **MEASURED_SIGNALS, **loop.law.signals})
    y = outputs.pack(
        {
            "torque": where(trip > 0, 0.0, testbed.motors.clip(tick.tau)),
            "tau": as_expression(tick.tau),
            **{f"{name}_measured": value for name, value in measured._asdict().items()},
            **tick.signals,
        }
    )
    x_next = ca.vertcat(where(trip > 0, x[:-1], following), trip)
    function = build("law_tick", {"u": u, "x": x, "p": p}, {"x_next": x_next, "y": y})
    used = ca.which_depends(ca.vertcat(x_next, y), p, 1, False)
    return LawTick(function, state, outputs, tuple(used))


def law_parameters(loop: ClosedLoop) -> dict[str, Any]:
    """The parameter sets whose numbers are inputs of `law_tick`, in its order."""
    known = loop.parameters()
    return {name: known[name] for name in ("testbed", "law") if name in known}


def _are_numbers(column: ca.SX) -> ca.SX:
    """1 for each entry that is neither infinite nor NaN, else 0."""
    return fabs(column) < LARGEST


def _all_numbers(column: ca.SX) -> Scalar:
    return ca.mmin(_are_numbers(column))
