"""A small loop that settles: joint springs push a damped arm against a damped body."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

import numpy as np

from alight.control import Law, Measurement, Tick
from alight.models import KelvinVoigt
from alight.simulation.batch import Request, Runs
from alight.simulation.closed_loop import ClosedLoop, InitialState
from alight.simulation.metrics import chosen
from alight.symbolic.ops import sqrt, vector, where
from alight.symbolic.parameters import Pair, Quantity, parameters
from alight.symbolic.signals import Signal
from alight.testbed import Testbed, Transducer
from tests.control.cases import PLANT

TRIP = 7
TRAVEL = 0.02


@parameters
class Pushing(Law):
    """Springs and dampers at the joints; it trips, or gives no torque, after some ticks."""

    goal: Annotated[Pair, Quantity("rad", "where the springs rest")]
    x_d: Annotated[float, Quantity("m", "where the mass shall be")] = 0.22
    trip_at: Annotated[float, Quantity("", "tick that trips")] = 1e9
    torque_until: Annotated[float, Quantity("", "last tick with a torque")] = 1e9
    real_until: Annotated[float, Quantity("", "last tick whose root is real")] = 1e9

    hole: Annotated[float, Quantity("", "tick at which the error is no number")] = 1e9

    states: ClassVar[Mapping[str, Signal]] = {"count": Signal("", "ticks so far")}
    signals: ClassVar[Mapping[str, Signal]] = {
        "e_m": Signal("m", "error of the mass"),
        "e_r": Signal("rad", "error of the joints", 2),
        "root": Signal("", "root of the ticks to come"),
    }
    trips: ClassVar[Mapping[int, str]] = {TRIP: "it has counted far enough"}

    def initial_state(self) -> dict[str, Any]:
        return {"count": 0.0}

    def tick(self, state: Mapping[str, Any], measured: Measurement, dt: Any) -> Tick:
        count = state["count"]
        error = vector(*(self.goal[i] - measured.q[i] for i in (0, 1)))
        lost = where(count > self.torque_until, sqrt(self.torque_until - count), 0.0)
        tau = vector(*(300 * error[i] - 40 * measured.q_dot[i] + lost for i in (0, 1)))
        root = sqrt(self.real_until - count)
        e_m = where(count == self.hole, sqrt(-1 - count), self.x_d - measured.x_m)
        signals = {"e_m": e_m, "e_r": error, "root": root}
        trip = where(count >= self.trip_at, float(TRIP), 0.0)
        return Tick(tau, {"count": count + 1}, signals, trip)


def pushing(noise: float = 1e-7, delay: bool = False) -> ClosedLoop:
    """The loop; its arm, body and contact all dissipate."""
    arm = dataclasses.replace(PLANT.arm, viscous=(20.0, 8.0))
    body = dataclasses.replace(PLANT.body, damping=60.0)
    plant = dataclasses.replace(
        PLANT, arm=arm, body=body, contact=KelvinVoigt(K_I=2e4, damping=200.0)
    )
    goal = plant.arm.inverse((body.x_0 + 0.05, 0.4), "-")
    law = Pushing(goal=(float(goal[0]), float(goal[1])))
    testbed = Testbed(transducer=Transducer(resolution=1e-6, noise=noise), delay=delay)
    return ClosedLoop(plant, testbed, law, substeps=1)


def begin(loop: ClosedLoop) -> InitialState:
    """Close before the body and moving towards it."""
    x_0 = loop.plant.body.x_0
    q = loop.plant.arm.inverse((x_0 - 2e-3, 0.4), "-")
    return InitialState(q=(float(q[0]), float(q[1])), x_m=x_0, q_dot=(-0.1, 0.1))


def column(start: InitialState) -> np.ndarray:
    return np.array([*start.q, start.x_m, *start.q_dot, start.x_m_dot])


def runs_of(loop: ClosedLoop, count: int, **parameters: np.ndarray) -> Runs:
    """Runs from the same start; names are paths with two underscores for each dot."""
    return Runs(
        start=np.repeat(column(begin(loop))[:, None], count, axis=1),
        parameters={path.replace("__", "."): values for path, values in parameters.items()},
        travel=np.full(count, TRAVEL),
        seeds=np.arange(count),
    )


def request(loop: ClosedLoop, ticks: int, **settings: Any) -> Request:
    """All metrics, on one thread, as C in a width that is none of the fewest."""
    asked: dict[str, Any] = {"backend": "c", "threads": 1, "width": 4}
    asked["steady_state"] = ticks * loop.dt / 3
    metrics = chosen(None, loop.signals)
    return Request(ticks=ticks, metrics=metrics, **{**asked, **settings})
