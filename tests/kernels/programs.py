"""Closed loops as programs, with what they start from."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, NamedTuple

import casadi as ca
import numpy as np

from alight.control import ForceLimiting, Law, Measurement, Tick, Unsaturated
from alight.kernels import Program, Runner
from alight.models import HuntCrossley, KelvinVoigt, Plant, TipFriction
from alight.simulation.closed_loop import ClosedLoop, InitialState, tick_program
from alight.symbolic.build import build
from alight.symbolic.ops import sin, sqrt, vector, where
from alight.symbolic.parameters import Quantity, parameters
from alight.symbolic.signals import Layout, Signal
from alight.testbed import Testbed, Transducer
from tests.control.cases import PLANT, told

TRIP = 7


@parameters
class Counting(Law):
    """Counts its ticks; trips at one of them, and gives a number that is none after another."""

    trip_at: Annotated[float, Quantity("", "tick that trips")] = 1e9
    real_until: Annotated[float, Quantity("", "last tick whose root is real")] = 1e9

    states: ClassVar[Mapping[str, Signal]] = {"count": Signal("", "ticks so far")}
    signals: ClassVar[Mapping[str, Signal]] = {"root": Signal("", "root of the ticks to come")}
    trips: ClassVar[Mapping[int, str]] = {TRIP: "it has counted far enough"}

    def initial_state(self) -> dict[str, Any]:
        return {"count": 0.0}

    def tick(self, state: Mapping[str, Any], measured: Measurement, dt: Any) -> Tick:
        count = state["count"]
        tau = vector(*(-2.0 * measured.q_dot[i] - 1e3 * measured.x_m_dot for i in (0, 1)))
        trip = where(count >= self.trip_at, float(TRIP), 0.0)
        return Tick(tau, {"count": count + 1}, {"root": sqrt(self.real_until - count)}, trip)


class Prepared(NamedTuple):
    """A program and the numbers of one run of it."""

    program: Program
    x: np.ndarray
    p: np.ndarray

    def run(self, runner: Runner, noise: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """State after, and rows of, as many ticks as there is noise."""
        return runner.run(self.x, noise, self.p)


def start(plant: Plant = PLANT) -> InitialState:
    """Close before the body and moving towards it."""
    q = plant.arm.inverse((plant.body.x_0 - 5e-3, 0.4), "-")
    return InitialState(
        q=(float(q[0]), float(q[1])), x_m=plant.body.x_0, q_dot=(-0.6, 0.4), x_m_dot=-0.1
    )


NOISY = Testbed(transducer=Transducer(resolution=1e-6, noise=1e-6))


def loops() -> dict[str, ClosedLoop]:
    """Loops that together use every contact law, friction, delay and both adaptive laws."""
    sticky = TipFriction(mu=0.3)
    damped = dataclasses.replace(
        PLANT, contact=KelvinVoigt(K_I=2e4, damping=50.0), tip_friction=sticky
    )
    round_tip = dataclasses.replace(PLANT, contact=HuntCrossley(exponent=1.5, dissipation=0.3))
    rubbing = dataclasses.replace(PLANT.arm, viscous=(1.0, 0.3), coulomb=(0.5, 0.2))
    return {
        "adaptive": ClosedLoop(PLANT, NOISY, told(), substeps=2),
        "friction": ClosedLoop(damped, NOISY, told(damped, cls=Unsaturated), substeps=1),
        "delay": ClosedLoop(
            dataclasses.replace(round_tip, arm=rubbing),
            dataclasses.replace(NOISY, delay=True),
            told(cls=ForceLimiting),
            substeps=1,
        ),
        "counting": counting(),
    }


def counting(**settings: float) -> ClosedLoop:
    """A loop whose program is small."""
    return ClosedLoop(PLANT, NOISY, Counting(**settings), substeps=1)


def tiny(unit: str = "m", trip_at: float = 1e9) -> Prepared:
    """No loop at all, but a program: compiled in a blink. Every seventh tick is a seldom one."""
    x, w, p = ca.SX.sym("x", 2), ca.SX.sym("w"), ca.SX.sym("p", 1)
    count, total = x[0], x[1]
    calls = where(ca.fmod(count, 7.0) == 3.0, 1.0, 0.0)
    following = ca.vertcat(count + 1, total + sin(count) + 1e-3 * w)
    trip = where(count >= p, float(TRIP), 0.0)
    rows = ca.vertcat(total, ca.tanh(w), trip)
    usual = build(
        f"usual_{unit}",
        {"x": x, "w": w, "p": p},
        {"x_next": following, "y": rows, "given": w, "calls": calls},
    )
    head = ca.vertcat(count + 1, total - w)
    seldom = build(
        f"seldom_{unit}", {"head": x, "given": w, "p": p}, {"head_next": head, "trip": ca.SX(0)}
    )
    layout = Layout({"total": Signal(unit, "a sum"), "noise": Signal("", "its tanh")})
    program = Program(usual, seldom, 1, layout, ("trip_at",))
    return Prepared(program, np.zeros(2), np.array([trip_at]))


def prepared(loop: ClosedLoop, channels: tuple[str, ...] | None = None) -> Prepared:
    """The program of a loop and where it starts."""
    return Prepared(
        tick_program(loop, channels),
        loop.initial_column(start(loop.plant)),
        loop.parameter_values(),
    )


def noise_of(ticks: int, seed: int = 0) -> np.ndarray:
    """Standard noise for a number of ticks."""
    return np.random.default_rng(seed).standard_normal(ticks)
