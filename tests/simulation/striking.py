"""Strikes at random, and their motion by an independent solver, one phase of contact at a time."""

from __future__ import annotations

import functools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from scipy.integrate import solve_ivp

from alight.kernels.direct import Direct
from alight.models import (
    HuntCrossley,
    KelvinVoigt,
    LinearSpring,
    MassSpring,
    Plant,
    PlantState,
    TwoLinkArm,
)
from alight.simulation.closed_loop import PLANT
from alight.symbolic.build import build
from alight.symbolic.ops import vector
from alight.symbolic.parameters import lift, values_of

AnyLaw = LinearSpring | KelvinVoigt | HuntCrossley
ARM = TwoLinkArm(l1=0.35, l2=0.3, p1=3.4, p2=0.2, p3=0.24)


def state_of(column: Any) -> PlantState:
    return PlantState(**PLANT.unpack(column))


def column_of(s: PlantState) -> Any:
    return PLANT.pack(s._asdict())


@dataclass(frozen=True)
class Strike:
    """A tip that flies towards a mass under a held torque, without friction at the tip."""

    plant: Plant
    start: np.ndarray
    tau: np.ndarray

    @property
    def half_period(self) -> float:
        """Half a period of the mass on the stiffness of the contact [s]."""
        return float(np.pi * np.sqrt(self.plant.body.m / self.plant.contact.K_I))


def strike(rng: np.random.Generator, law: type[AnyLaw]) -> Strike:
    """One strike at random, 0.1 to 2 mm before the touch."""
    K_I = 10 ** rng.uniform(3.5, 5.5)
    contact: AnyLaw
    if law is KelvinVoigt:
        contact = KelvinVoigt(K_I=K_I, damping=rng.uniform(0.0, 0.6) * np.sqrt(K_I))
    elif law is HuntCrossley:
        contact = HuntCrossley(K_I=K_I, dissipation=rng.uniform(0.0, 2.0))
    else:
        contact = LinearSpring(K_I=K_I)
    body = MassSpring(rng.uniform(0.5, 4.0), rng.uniform(100, 2000), 0.2, rng.uniform(0.0, 10.0))
    q = ARM.inverse((0.2 - rng.uniform(1e-4, 2e-3), 0.4), "-")
    q_dot = np.linalg.solve(ARM.J(q), [rng.uniform(0.1, 1.0), rng.uniform(-1.0, 1.0)])
    start = column_of(PlantState(q, q_dot, 0.2, rng.uniform(-0.3, 0.05), 0.0))
    return Strike(Plant(ARM, body, contact), start, rng.uniform(-5.0, 5.0, 2))


class Exact:
    """The motion by DOP853 between the events, under forces that are typed here once more."""

    def __init__(self, hit: Strike) -> None:
        self.hit, self._p = hit, values_of(hit.plant)
        self._rates, self._gap = _mechanics(type(hit.plant.contact))

    def force(self, x: np.ndarray) -> float:
        """Force of the closed contact [N]."""
        law, (gap, gap_dot) = self.hit.plant.contact, self._gaps(x)
        if isinstance(law, KelvinVoigt):
            return law.K_I * gap + law.damping * gap_dot
        if isinstance(law, HuntCrossley):
            return law.K_I * max(gap, 0.0) ** law.exponent * (1 + law.dissipation * gap_dot)
        return law.K_I * gap

    def margins(self, x: np.ndarray) -> list[float]:
        """What must all be positive for the contact to stay closed."""
        law, (gap, gap_dot) = self.hit.plant.contact, self._gaps(x)
        if isinstance(law, KelvinVoigt):
            return [gap, gap + law.damping / law.K_I * gap_dot]
        if isinstance(law, HuntCrossley):
            return [gap, 1 + law.dissipation * gap_dot]
        return [gap]

    def _gaps(self, x: np.ndarray) -> tuple[float, float]:
        gap, gap_dot = self._gap(self._p, x)
        return float(gap[0]), float(gap_dot[0])

    def until(
        self, end: float, x: np.ndarray | None = None, closed: bool = False
    ) -> tuple[np.ndarray, list[float]]:
        """State at a time [s], from the start of the strike or another, and the switches before."""
        x, t, switches = self.hit.start if x is None else x, 0.0, []
        while True:
            part = solve_ivp(
                lambda _, at, closed=closed: self._rates(
                    self._p, at, self.hit.tau, self.force(at) if closed else 0.0
                )[0],
                (t, end),
                x,
                "DOP853",
                rtol=1e-13,
                atol=1e-15,
                events=self._events(closed),
            )
            t, x = float(part.t[-1]), part.y[:, -1]
            if part.status == 0:
                return x, switches
            switches.append(t)
            closed = not closed

    def _events(self, closed: bool) -> list[Any]:
        events = []
        for i in range(len(self.margins(self.hit.start)) if closed else 1):

            def margin(_: float, x: np.ndarray, i: int = i) -> float:
                return self.margins(x)[i]

            margin.terminal, margin.direction = True, -1 if closed else 1  # type: ignore[attr-defined]
            events.append(margin)
        return events


@functools.cache
def _mechanics(law: type[AnyLaw]) -> tuple[Direct, Direct]:
    """Rates under a given contact force, and gap and its rate, for all plants of one law."""
    lifted, x = lift(Plant(ARM, MassSpring(1.0, 1.0, 0.0), law())), ca.SX.sym("x", PLANT.size)
    tau, force = ca.SX.sym("tau", 2), ca.SX.sym("F")
    plant, s = lifted.obj, state_of(x)
    rates = PlantState(
        q=s.q_dot,
        q_dot=plant.arm.acceleration(s.q, s.q_dot, tau, vector(force, 0.0)),
        x_m=s.x_m_dot,
        x_m_dot=plant.body.acceleration(s.x_m, s.x_m_dot, force),
        z=0.0,
    )
    inputs = {"p": lifted.symbols, "x": x}
    outputs = {
        "gap": plant.arm.x_r(s.q)[0] - s.x_m,
        "gap_dot": (plant.arm.J(s.q) @ s.q_dot)[0] - s.x_m_dot,
    }
    moving = build("moving", {**inputs, "tau": tau, "F": force}, {"rates": column_of(rates)})
    return Direct(moving), Direct(build("gap", inputs, outputs))


class Known(NamedTuple):
    """A strike that hits once and separates once, and where it leads."""

    hit: Strike
    exact: Exact
    touch: float
    """Time of the touch [s]."""
    release: float
    """Time of the separation [s]."""
    duration: float
    end: np.ndarray
    """State at the end."""


def known_strikes(law: type[AnyLaw], count: int, seed: int = 0) -> Iterator[Known]:
    """Strikes that touch and separate, ended some time after; those that touch again are left out.

    Left out are those as well that stay in contact for more than three half periods.
    """
    rng = np.random.default_rng(seed)
    found = 0
    while found < count:
        hit = strike(rng, law)
        exact = Exact(hit)
        longest = 0.02 + 3 * hit.half_period
        _, switches = exact.until(longest)
        if len(switches) < 2:
            continue
        touch, release = switches[:2]
        duration = release + rng.uniform(0.2, 0.5) * (release - touch)
        end, switches = exact.until(duration)
        if len(switches) == 2:
            found += 1
            yield Known(hit, exact, touch, release, duration, end)
