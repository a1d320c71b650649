"""Hypothesis strategies for laws on the paper's error system, and for states of their loops."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from alight.control import (
    AdaptiveContactLaw,
    AdaptiveState,
    Estimate,
    ForceLimiting,
    Gains,
    Target,
)
from alight.models import LinearSpring, MassSpring, Plant, PlantState, TwoLinkArm
from alight.simulation.continuous import join_state
from tests.strategies import Plane, between, linear_springs, log_between, plant_states, plants

L = TypeVar("L", bound=AdaptiveContactLaw)

PLANT = Plant(
    arm=TwoLinkArm(l1=0.35, l2=0.3, p1=3.4, p2=0.2, p3=0.24),
    body=MassSpring(m=1.5, k_s=600.0, x_0=0.206),
    contact=LinearSpring(K_I=2e4),
)
"""A lossless plant as in (1)-(8)."""

TARGET = Target(x_md=0.236, x_rd2=0.358)  # (41), Section V-A

EXPERIMENT_1 = Gains(
    k1=2.0,
    k2=0.47,
    k3=(95.0, 5.0),
    alpha1=55.0,
    alpha2=15.0,
    alpha3=0.1,
    alpha=(50.0, 4.5),
    Gamma=1.0,
)  # (42), (43)
EXPERIMENT_2 = Gains(
    k1=0.22,
    k2=2.945,
    k3=(185.0, 175.0),
    alpha1=75.0,
    alpha2=100.0,
    alpha3=0.001,
    alpha=(80.0, 100.0),
    Gamma=0.1,
)  # Section V-B
STABLE = dataclasses.replace(EXPERIMENT_1, alpha1=10.0, alpha3=1.0)
"""Those of experiment 1, moved to the stable side of condition LOC."""


def true_theta_r(plant: Plant) -> np.ndarray:
    """The entries behind (43), typed: three blocks of ``p_j (K_I/m, k_s/m, 1)``, then ``K_I``.

    In a vertical plane the two gravity torques follow.
    """
    arm, m, k_s, K_I = plant.arm, plant.body.m, plant.body.k_s, plant.contact.K_I
    blocks = np.outer([arm.p1, arm.p2, arm.p3], [K_I / m, k_s / m, 1.0])
    weights = [arm.g1, arm.g2] if arm.plane == "vertical" else []
    return np.array([*blocks.ravel(), K_I, *weights])


@st.composite
def boxes(draw: st.DrawFn, truth: np.ndarray | float) -> Estimate:
    """Bounds that hold positive true values, not in their middle, and a start between them."""
    below, above, start = draw(between(0.1, 0.9)), draw(between(0.1, 2.0)), draw(between(0.0, 1.0))
    lower, upper = (1 - below) * np.asarray(truth), (1 + above) * np.asarray(truth)
    initial = np.clip(lower + start * (upper - lower), lower, upper)
    fields = (v.tolist() for v in (initial, lower, upper))
    return Estimate(
        *(tuple(v) if isinstance(v, list) else v for v in fields), margin=draw(between(0.02, 0.5))
    )


@st.composite
def within(draw: st.DrawFn, estimate: Estimate) -> Any:
    """Values of an estimate anywhere in its widened interval, one draw for each entry."""
    low, high = (np.asarray(v) for v in estimate.widened)
    shares = [draw(between(0.0, 1.0)) for _ in range(low.size)]
    value = np.clip(low + np.reshape(shares, low.shape) * (high - low), low, high)
    return value if value.ndim else float(value)


def gains() -> SearchStrategy[Gains]:
    """Positive gains over the decades around those of both experiments."""
    pair = st.tuples
    return st.builds(
        Gains,
        k1=log_between(0.1, 10.0),
        k2=log_between(0.05, 5.0),
        k3=pair(log_between(1.0, 300.0), log_between(1.0, 300.0)),
        alpha1=log_between(1.0, 100.0),
        alpha2=log_between(1.0, 100.0),
        alpha3=log_between(1e-3, 10.0),
        alpha=pair(log_between(1.0, 100.0), log_between(1.0, 100.0)),
        Gamma=log_between(1e-2, 10.0),
    )


@st.composite
def laws(draw: st.DrawFn, cls: type[L] = ForceLimiting, plane: Plane = "horizontal") -> L:  # type: ignore[assignment]
    """Laws told of a plant as in (1)-(8), whose boxes hold its true parameters."""
    plant = draw(plants(linear_springs(), plane, friction=False))
    body = MassSpring(plant.body.m, plant.body.k_s, plant.body.x_0)
    plant = Plant(plant.arm, body, plant.contact)
    theta_r = true_theta_r(plant)
    speeds = [draw(log_between(1e-4, 1.0)) for _ in theta_r]
    return cls(
        model=plant,
        target=Target(x_md=body.x_0 + draw(between(0.005, 0.1)), x_rd2=draw(between(-0.5, 0.5))),
        gains=draw(gains()),
        e_f=draw(between(-1.0, 1.0)),
        Gamma_r=tuple(speeds * theta_r**2),
        theta_dk=draw(boxes(plant.theta_dk)),
        theta_r=draw(boxes(theta_r)),
    )


def told(
    plant: Plant = PLANT,
    gains: Gains = STABLE,
    cls: type[L] = ForceLimiting,  # type: ignore[assignment]
    speed: float = 1e-3,
    **changes: Any,
) -> L:
    """A law told of a plant; its estimates start between half and twice the truth, at 0.7 of it."""
    theta_r = true_theta_r(plant)
    settings = {
        "Gamma_r": tuple(speed * theta_r**2),
        "theta_dk": Estimate(0.7 * plant.theta_dk, plant.theta_dk / 2, 2 * plant.theta_dk),
        "theta_r": Estimate(tuple(0.7 * theta_r), tuple(theta_r / 2), tuple(2 * theta_r)),
        **changes,
    }
    return cls(model=plant, target=TARGET, gains=gains, **settings)


@dataclass(frozen=True)
class Case:
    """A law with the plant it is told of, and a state of both."""

    law: AdaptiveContactLaw
    s: PlantState
    e_f: float
    a: AdaptiveState

    @property
    def column(self) -> np.ndarray:
        """The state of plant and law as one column."""
        return join_state(self.law, self.s, self.a._asdict())


@st.composite
def cases(
    draw: st.DrawFn,
    cls: type[AdaptiveContactLaw] = ForceLimiting,
    plane: Plane = "horizontal",
    deepest: float = 5e-3,
) -> Case:
    """Laws and states, in contact and out of it, projections active or not."""
    law = draw(laws(cls, plane))
    s = draw(plant_states(law.model, deepest))._replace(z=0.0)
    e_f = draw(between(-1.5, 1.5))
    estimates = draw(within(law.theta_dk)), draw(within(law.theta_r))
    return Case(law, s, e_f, AdaptiveState(float(np.tanh(e_f)), *estimates))


def changed(law: L, **gains: Any) -> L:
    """The same law with other gains."""
    return dataclasses.replace(law, gains=dataclasses.replace(law.gains, **gains))
