"""What Theorem 1 is evaluated from: numbers alone, without a plant or a law."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from alight.control import Estimate, ForceLimiting, Gains
from alight.models import LinearSpring, MassSpring, Plant
from alight.scenarios.assumptions import Assumptions
from alight.theory.case import Case
from alight.theory.inertia import InertiaBounds
from alight.theory.lossless import lossless
from alight.theory.lyapunov import V, V_r
from alight.theory.proven.robot_part import largest_V_r


@dataclass(frozen=True)
class Design:
    """Gains, bounds and start of a run: all that the conditions of Theorem 1 depend on."""

    gains: Gains
    bounds: Assumptions
    inertia: InertiaBounds
    x_md: float
    """Set point of the mass [m]."""
    x_0: float
    """Rest position of the mass [m]."""
    theta_dk: Estimate
    theta_r: Estimate
    Gamma_r: tuple[float, ...]
    """Adaptation gains of (33)."""
    z_bar: float
    """Norm of ``z_bar(0)`` of (49), its entries in SI units."""
    V_0: float
    """Largest ``V(0)`` over the boxes of the parameters and the bounds of Assumption 2 [J]."""

    @property
    def e_m_rest(self) -> float:
        """Error of the mass at rest at ``x_0`` [m]: most that (69) may take for its lower bound."""
        return self.x_md - self.x_0

    @property
    def e_m_upper(self) -> float:
        """Bound (68) [m]: in free motion ``x_m`` exceeds ``x_r1``, and that exceeds ``zeta_xr``."""
        return self.x_md - self.bounds.zeta_xr


def design_of(case: Case) -> Design:
    """The design of a case, under (32) whatever the feedback of its law."""
    settings = {f.name: getattr(case.law, f.name) for f in dataclasses.fields(ForceLimiting)}
    case = dataclasses.replace(case, law=ForceLimiting(**settings))
    law, e = case.law, case.e
    z_bar = [*e.r_r, *e.e_r, e.eta_m, e.e_m, np.arctanh(case.a.u_f)]
    return Design(
        gains=law.gains,
        bounds=case.bounds,
        inertia=case.inertia,
        x_md=law.target.x_md,
        x_0=law.model.body.x_0,
        theta_dk=law.theta_dk,
        theta_r=law.theta_r,
        Gamma_r=law.Gamma_r,
        z_bar=float(np.linalg.norm(z_bar)),
        V_0=_largest_V(case),
    )


def _largest_V(case: Case) -> float:
    """Largest ``V`` at the start [J].

    What `V` adds to `V_r` grows with ``m`` and ``K_I`` and is convex in ``theta_dk``.
    """
    law, bounds = case.law, case.bounds
    K_I, known = bounds.zeta_K[1], lossless(law.model)
    added = []
    for theta_dk in (law.theta_dk.lower, law.theta_dk.upper):
        body = MassSpring(bounds.m_u, float(theta_dk) * K_I, known.body.x_0)  # type: ignore[arg-type]
        worst = (Plant(known.arm, body, LinearSpring(K_I=K_I)), law, case.s, case.a)
        added.append(float(V(*worst) - V_r(*worst)))
    return largest_V_r(case) + max(added)
