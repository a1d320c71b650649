"""Hypothesis strategies for everything physical: arms, poses, rates, bodies, contacts, plants."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy

from alight.models import (
    HuntCrossley,
    KelvinVoigt,
    LinearSpring,
    MassSpring,
    Plant,
    PlantState,
    TipFriction,
    TwoLinkArm,
)

Plane = Literal["horizontal", "vertical"]
GRAVITY = 9.81  # [m/s^2]


def between(low: float, high: float) -> SearchStrategy[float]:
    """Finite floats of an interval."""
    return st.floats(low, high, allow_nan=False, allow_subnormal=False)


def log_between(low: float, high: float) -> SearchStrategy[float]:
    """Positive floats, evenly spread over the decades of an interval."""
    return between(np.log10(low), np.log10(high)).map(lambda e: min(max(10.0**e, low), high))


def vectors(size: int, bound: float) -> SearchStrategy[np.ndarray]:
    """Arrays of shape ``(size,)`` with entries up to ``bound`` in magnitude."""
    entries = st.lists(between(-bound, bound), min_size=size, max_size=size)
    return entries.map(lambda e: np.array(e, dtype=float))


@dataclass(frozen=True)
class Links:
    """Two rigid links as a manufacturer states them: what a multibody library is fed with."""

    l: tuple[float, float]  # noqa: E741
    """Lengths [m]."""
    m: tuple[float, float]
    """Masses [kg]."""
    l_c: tuple[float, float]
    """Distances of the centres of mass from the proximal joints [m]."""
    inertia: tuple[float, float]
    """Inertias about the centres of mass [kg m^2]."""

    def arm(self, plane: Plane = "horizontal", **friction: Any) -> TwoLinkArm:
        """Alight's arm of the same links."""
        (l1, l2), (m1, m2), (c1, c2), (i1, i2) = self.l, self.m, self.l_c, self.inertia
        weights = {"g1": (m1 * c1 + m2 * l1) * GRAVITY, "g2": m2 * c2 * GRAVITY}
        return TwoLinkArm(
            l1=l1,
            l2=l2,
            p1=i1 + m1 * c1**2 + i2 + m2 * (l1**2 + c2**2),
            p2=i2 + m2 * c2**2,
            p3=m2 * l1 * c2,
            plane=plane,
            **(weights if plane == "vertical" else {}),
            **friction,
        )


@st.composite
def links(draw: st.DrawFn) -> Links:
    """Links of a bench-top to a man-sized arm."""
    length = (draw(between(0.15, 0.8)), draw(between(0.15, 0.8)))
    mass = (draw(between(0.3, 15.0)), draw(between(0.3, 15.0)))
    centre = tuple(draw(between(0.2, 0.8)) * span for span in length)
    spread = (draw(between(0.02, 0.2)), draw(between(0.02, 0.2)))
    inertia = tuple(s * m * span**2 for s, m, span in zip(spread, mass, length, strict=True))
    return Links(length, mass, centre, inertia)  # type: ignore[arg-type]


@st.composite
def arms(draw: st.DrawFn, plane: Plane = "horizontal", friction: bool = False) -> TwoLinkArm:
    """Valid arms, without joint friction unless asked for."""
    rubbing = {}
    if friction:
        rubbing = {
            "viscous": (draw(between(0.0, 5.0)), draw(between(0.0, 5.0))),
            "coulomb": (draw(between(0.0, 5.0)), draw(between(0.0, 5.0))),
            "coulomb_speed": draw(log_between(1e-3, 1e-1)),
        }
    return draw(links()).arm(plane, **rubbing)


@st.composite
def poses(draw: st.DrawFn, margin: float = 0.3) -> np.ndarray:
    """Joint angles [rad] whose elbow is at least ``margin`` away from the singular poses."""
    elbow = draw(between(margin, np.pi - margin)) * draw(st.sampled_from([-1.0, 1.0]))
    return np.array([draw(between(-np.pi, np.pi)), elbow])


def rates(bound: float = 10.0) -> SearchStrategy[np.ndarray]:
    """Joint rates [rad/s]."""
    return vectors(2, bound)


def bodies() -> SearchStrategy[MassSpring]:
    """Bodies to strike."""
    return st.builds(
        MassSpring,
        m=log_between(0.1, 20.0),
        k_s=log_between(50.0, 5e3),
        x_0=between(-0.3, 0.3),
        damping=between(0.0, 20.0),
    )


def linear_springs() -> SearchStrategy[LinearSpring]:
    """The paper's contact."""
    return st.builds(LinearSpring, K_I=log_between(1e3, 1e6))


def kelvin_voigts() -> SearchStrategy[KelvinVoigt]:
    """Spring and damper."""
    return st.builds(KelvinVoigt, K_I=log_between(1e3, 1e6), damping=between(0.0, 500.0))


def hunt_crossleys() -> SearchStrategy[HuntCrossley]:
    """Spring with dissipation proportional to its force."""
    return st.builds(
        HuntCrossley,
        K_I=log_between(1e3, 1e6),
        exponent=between(1.0, 2.0),
        dissipation=between(0.0, 2.0),
    )


CONTACT_LAWS = {
    LinearSpring: linear_springs,
    KelvinVoigt: kelvin_voigts,
    HuntCrossley: hunt_crossleys,
}
"""Strategy of each contact law."""


def contact_laws() -> SearchStrategy[LinearSpring | KelvinVoigt | HuntCrossley]:
    """Any contact law."""
    return st.one_of(*(strategy() for strategy in CONTACT_LAWS.values()))


@st.composite
def tip_frictions(draw: st.DrawFn, damped: bool = False) -> TipFriction:
    """Friction at the tip; ``damped`` if the bristle's damping shall reach its response."""
    response = draw(log_between(2e-4, 1e-2))
    return TipFriction(
        mu=draw(between(0.05, 1.0)),
        deflection=draw(log_between(1e-5, 1e-3)),
        damping=response * draw(between(1.0, 5.0)) if damped else draw(between(0.0, 1e-2)),
        breakaway=draw(between(0.1, 0.9)),
        response=response,
    )


@st.composite
def plants(
    draw: st.DrawFn,
    contact: SearchStrategy[Any] | None = None,
    plane: Plane = "horizontal",
    friction: bool = True,
) -> Plant:
    """Plants with any contact law; ``friction`` at the joints and at the tip if wanted."""
    return Plant(
        arm=draw(arms(plane, friction)),
        body=draw(bodies()),
        contact=draw(contact if contact is not None else contact_laws()),
        tip_friction=draw(tip_frictions()) if friction else TipFriction(),
    )


@st.composite
def plant_states(draw: st.DrawFn, plant: Plant, deepest: float = 5e-3) -> PlantState:
    """States of a plant away from singular poses, in contact (up to ``deepest`` [m]) and out of it.

    The bristle stays within its deflection, where the plant keeps it.
    """
    q = draw(poses())
    gap = draw(st.one_of(between(-0.1, 0.0), between(0.0, deepest)))
    return PlantState(
        q=q,
        q_dot=draw(rates(5.0)),
        x_m=float(plant.arm.x_r(q)[0]) - gap,
        x_m_dot=draw(between(-2.0, 2.0)),
        z=draw(between(-1.0, 1.0)) * plant.tip_friction.deflection,
    )
