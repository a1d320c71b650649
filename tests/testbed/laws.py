"""Laws that do one thing each, a plant to try them on, and the backends that run it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
import pytest

from alight.control import Law, Measurement, PlainLaw, Tick
from alight.kernels.select import Backend
from alight.models import LinearSpring, MassSpring, Plant, TwoLinkArm
from alight.simulation.closed_loop import ClosedLoop, InitialState
from alight.simulation.recording import Recording
from alight.simulation.run import run
from alight.symbolic.ops import Vector, as_vector, exp, sin, sqrt, vector, where
from alight.symbolic.parameters import Pair, Quantity, parameters
from alight.symbolic.signals import Signal
from alight.testbed import Testbed
from tests.compiler import NEEDS_COMPILER

PLANT_UNDER_TEST = Plant(
    arm=TwoLinkArm(l1=0.35, l2=0.3, p1=3.4, p2=0.2, p3=0.24, viscous=(1.0, 0.3)),
    body=MassSpring(m=1.5, k_s=600.0, x_0=0.2, damping=5.0),
    contact=LinearSpring(K_I=2e4),
)
Q = PLANT_UNDER_TEST.arm.inverse((0.19, 0.4), "-")
START = InitialState(q=(float(Q[0]), float(Q[1])), x_m=0.2, q_dot=(-1.0, 1.0), x_m_dot=0.25)


BACKENDS = pytest.mark.parametrize("backend", ["vm", pytest.param("c", marks=NEEDS_COMPILER)])


def each_way(symbolic: Any, plain: Any) -> pytest.MarkDecorator:
    """Parametrize by a law on both backends, and by the same one in plain Python, on none."""
    ways = [
        pytest.param(symbolic, "vm", id="vm"),
        pytest.param(symbolic, "c", id="c", marks=NEEDS_COMPILER),
        pytest.param(plain, "auto", id="plain"),
    ]
    return pytest.mark.parametrize(("law", "backend"), ways)


def ran(
    law: Law,
    duration: float = 0.2,
    seed: int = 0,
    channels: tuple[str, ...] | None = None,
    backend: Backend = "vm",
    **testbed: Any,
) -> Recording:
    """Run a law on the plant above from its start."""
    loop = ClosedLoop(PLANT_UNDER_TEST, Testbed(**testbed), law)
    return run(loop, START, duration, seed=seed, channels=channels, backend=backend)


@parameters
class Shaking(Law):
    """Brakes the joints and shakes them, beyond what the second motor can give."""

    states: ClassVar[Mapping[str, Signal]] = {"phase": Signal("rad", "phase of the shaking")}

    def initial_state(self) -> dict[str, Any]:
        return {"phase": 0.3}

    def tick(self, state: Mapping[str, Any], measured: Measurement, dt: Any) -> Tick:
        shake = sin(state["phase"])
        brake = 2.0 * measured.q_dot
        tau = vector(60 * shake - brake[0], 30 * shake - brake[1] + 1e3 * measured.x_m_dot)
        return Tick(tau, {"phase": state["phase"] + 97 * dt}, {})


class PlainShaking(PlainLaw):
    """The same law as one in ordinary Python."""

    states = Shaking.states

    def initial_state(self) -> Mapping[str, Any]:
        return Shaking().initial_state()

    def tick(self, state: Mapping[str, Any], measured: Measurement, dt: Any) -> Tick:
        return Shaking().tick(state, measured, dt)


Lost = Literal["nan", "inf", "-inf"]


@parameters
class Losing(Law):
    """Brakes the joints; from some time on one of its torques is no number."""

    lost: Annotated[Lost, Quantity("", "what that torque becomes")]
    joint: Annotated[Literal[1, 2], Quantity("", "whose torque it is")] = 1
    until: Annotated[float, Quantity("s", "time of the last number")] = 0.0123
    tripping: Annotated[bool, Quantity("", "whether the law notices")] = False
    states: ClassVar[Mapping[str, Signal]] = {"elapsed": Signal("s", "time since the start")}
    trips: ClassVar[Mapping[int, str]] = {7: "its time is over"}

    def initial_state(self) -> dict[str, Any]:
        return {"elapsed": 0.0}

    def value(self, left: Any) -> Any:
        """Zero while there is time left."""
        if self.lost == "nan":
            return where(left >= 0, 0.0, sqrt(left))
        flood = exp(-1e9 * left)
        return flood if self.lost == "inf" else -flood

    def tick(self, state: Mapping[str, Any], measured: Measurement, dt: Any) -> Tick:
        left = self.until - state["elapsed"]
        torques = [-2.0 * measured.q_dot[0], -2.0 * measured.q_dot[1]]
        torques[self.joint - 1] += self.value(left)
        trip = where(left < 0, 7.0, 0.0) if self.tripping else 0.0
        return Tick(vector(*torques), {"elapsed": state["elapsed"] + dt}, {}, trip)


class PlainLosing(PlainLaw):
    """The same law as one in ordinary Python."""

    states = Losing.states
    trips = Losing.trips

    def __init__(self, *args: Any, **settings: Any) -> None:
        self.law = Losing(*args, **settings)

    def initial_state(self) -> Mapping[str, Any]:
        return self.law.initial_state()

    def tick(self, state: Mapping[str, Any], measured: Measurement, dt: Any) -> Tick:
        with np.errstate(over="ignore", invalid="ignore"):
            return self.law.tick(state, measured, dt)


@parameters
class Steady(Law):
    """A constant torque: no state, and nothing measured."""

    tau: Annotated[Pair, Quantity("N m", "the torque")]
    states: ClassVar[Mapping[str, Signal]] = {}

    def initial_state(self) -> Mapping[str, Any]:
        return {}

    def tick(self, state: Mapping[str, Any], measured: Measurement, dt: Any) -> Tick:
        return Tick(as_vector(self.tau), {}, {})


class PlainSteady(Steady, PlainLaw):
    """The same law as one in ordinary Python."""


class Braking(Law):
    """A law without state that is no parameter set."""

    states: ClassVar[Mapping[str, Signal]] = {}

    def __init__(self, gain: float) -> None:
        self.gain = gain

    def initial_state(self) -> Mapping[str, Any]:
        return {}

    def tick(self, state: Mapping[str, Any], measured: Measurement, dt: Any) -> Tick:
        return Tick(self.torque(measured.q_dot), {}, {})

    def torque(self, q_dot: Vector) -> Vector:
        """Brake of each joint [N m]."""
        return -self.gain * q_dot


class PlainBraking(Braking, PlainLaw):
    """The same law as one in ordinary Python."""
