"""Loops at rest that the tests of this folder share, and what a sample truly does to them."""

from __future__ import annotations

import dataclasses
import functools
from dataclasses import dataclass

import casadi as ca
import numpy as np
from scipy.integrate import solve_ivp

from alight.control import AdaptiveContactLaw, ForceLimiting, Measurement, Unsaturated
from alight.models import HuntCrossley, KelvinVoigt, LinearSpring, MassSpring, Plant, PlantState
from alight.symbolic.build import build
from alight.symbolic.signals import Layout
from alight.testbed import Testbed
from alight.theory.sampled import LinearLoop, linear_loop, rest_in_contact, rest_in_free_motion
from tests.control.cases import EXPERIMENT_1, EXPERIMENT_2, PLANT, STABLE, told

T = 5e-4
RUBBING = dataclasses.replace(PLANT.arm, viscous=(1.5, 0.5), coulomb=(0.2, 0.1), coulomb_speed=0.05)
LOSSY = Plant(
    RUBBING, MassSpring(1.5, 600.0, 0.206, damping=5.0), KelvinVoigt(K_I=2e4, damping=60.0)
)
HERTZ = dataclasses.replace(LOSSY, contact=HuntCrossley(K_I=2e6, exponent=1.5, dissipation=0.5))
UPRIGHT = dataclasses.replace(
    PLANT, arm=dataclasses.replace(PLANT.arm, plane="vertical", g1=8.0, g2=2.0)
)

LOOPS = {
    "lossless": (PLANT, STABLE, ForceLimiting),
    "(42)": (PLANT, EXPERIMENT_1, ForceLimiting),
    "with losses": (LOSSY, EXPERIMENT_1, ForceLimiting),
    "unsaturated": (LOSSY, EXPERIMENT_2, Unsaturated),
    "upright": (UPRIGHT, STABLE, ForceLimiting),
    "curved": (HERTZ, STABLE, ForceLimiting),
}
PHASES = {"contact": rest_in_contact, "free motion": rest_in_free_motion}


def law_for(name: str) -> AdaptiveContactLaw:
    """A law that is told the stiffness which the contact shows at rest."""
    plant, gains, cls = LOOPS[name]
    if isinstance(plant.contact, HuntCrossley):
        held = plant.body.k_s * 0.030
        stiffness = held / (held / plant.contact.K_I) ** (1 / plant.contact.exponent)
    else:
        stiffness = plant.contact.K_I
    return told(dataclasses.replace(plant, contact=LinearSpring(K_I=stiffness)), gains, cls)


@dataclass(frozen=True)
class Subject:
    """A linear loop beside the nonlinear functions that it was derived from."""

    linear: LinearLoop
    tick: ca.Function
    rates: ca.Function

    @property
    def at(self) -> np.ndarray:
        """The rest, in the coordinates of the linear loop, no torque held back."""
        rest = self.linear.rest
        plant = [*rest.s.q, *rest.s.q_dot, rest.s.x_m, rest.s.x_m_dot]
        return np.concatenate([plant, np.zeros(3), *np.atleast_1d(*rest.a)])

    @property
    def scale(self) -> np.ndarray:
        """Small changes of each state: far less than the penetration, 0.1 % of an estimate."""
        moving = [1e-6, 1e-6, 1e-4, 1e-4, 1e-6, 1e-4]
        return np.array([*moving, 1e-4, 1e-4, 1e-4, 1e-5, *(1e-3 * np.abs(self.at[10:]))])

    def step(self, x: np.ndarray, delay: bool) -> np.ndarray:
        """One sample of the nonlinear loop, its contact held as the rest has it."""
        v, memory, held = x[6:9], x[9 : len(self.at)], x[len(self.at) :]
        read = x[[0, 1, 4]]
        shown = [*x[:2], *v[:2], x[4], v[2]]
        tau, following = (np.asarray(out).ravel() for out in self.tick(shown, memory))
        applied = held if delay else tau
        solved = solve_ivp(
            lambda _, y: np.asarray(self.rates(y, applied)).ravel(),
            (0.0, T),
            x[:6],
            method="DOP853",
            rtol=1e-13,
            atol=1e-16,
        )
        end = solved.y[:, -1]
        return np.concatenate([end, (end[[0, 1, 4]] - read) / T, following, tau if delay else []])


@functools.cache
def subject(name: str, phase: str) -> Subject:
    """One of `LOOPS`, in contact or in free motion."""
    plant = LOOPS[name][0]
    rest = PHASES[phase](plant, law_for(name), "-")
    layout = Layout(rest.law.states)
    seen, memory = ca.SX.sym("seen", 6), ca.SX.sym("memory", layout.size)
    measured = Measurement(seen[:2], seen[2:4], seen[4], seen[5])
    tick = rest.law.tick(layout.unpack(memory), measured, T)
    following = layout.pack(dict(tick.state))
    x, tau = ca.SX.sym("x", 6), ca.SX.sym("tau", 2)
    moved = plant.rates(PlantState(x[:2], x[2:4], x[4], x[5], 0.0), tau, rest.pressing)
    return Subject(
        linear_loop(rest, Testbed()),
        build("tick", {"seen": seen, "memory": memory}, {"tau": tick.tau, "next": following}),
        build("rates", {"x": x, "tau": tau}, {"x_dot": ca.vertcat(*moved[:4])}),
    )
