"""Proposition B: the mass in contact, and condition VTX.

In contact, with ``V_m`` the mass part of (47), ``K = K_I``, ``a = sech^2(e_m)``,
``b = sech^2(e_f)`` and ``z = (tanh(e_m), tanh(e_f), eta_m)``,

    V_m_dot = -z^T Q(a, b) z + K eta_m e_r1 - (work of the projection),

where the work of the projection is never negative: all other cross terms cancel, since in contact
``m eta_m_dot = -K Y_d theta_tilde ... + K e_r1`` by (19), (25) and (7). ``Q`` is affine in
``(a, b)``, its first two rows are diagonal and positive; it is positive definite just where its
Schur complement is positive, which is ``m`` times

    alpha2 k1 - load(a, b),
    load(a, b) = alpha1 a + c [(alpha1^2 a - alpha2^2 b)^2 / alpha1
                               + alpha2^2 (alpha1 a + alpha3 b)^2 / alpha3],    c = m / (4 k2 K).

The load is convex in ``(a, b)``, so that over the unit square it is largest at a vertex, and
always at (1, 1):

    load(0, 0) = 0,
    load(1, 1) - load(1, 0) = c alpha2^2 (alpha2^2 / alpha1 + alpha3) > 0,
    load(1, 1) - load(0, 1) = alpha1 + c alpha1^2 (alpha1 + alpha2^2 / alpha3) > 0.

So condition VTX, ``alpha2 k1 > load(1, 1)``, makes ``Q`` positive definite at every state. The
vertex is ``e_m = e_f = 0``: VTX is also necessary, but for equality, for ``V_m`` to fall near rest.
For every state ``z^T Q z >= m vtx_margin eta_m^2``, whatever ``tanh(e_m)`` and ``tanh(e_f)``; hence

    V_m_dot <= K |eta_m| |e_r1| - m vtx_margin eta_m^2 <= K^2 e_r1^2 / (4 m vtx_margin),

and with the integral of ``e_r1^2`` from Proposition A, in permanent contact, ``V_m`` is bounded
for every initial state; (38) and (39) are not needed.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from alight.control import AdaptiveContactLaw, AdaptiveState, Gains
from alight.models import LinearSpring, MassSpring, Plant, PlantState
from alight.symbolic.ops import Scalar
from alight.theory.case import Case
from alight.theory.lyapunov import V_m
from alight.theory.proven.first_contact import first_contact
from alight.theory.proven.robot_part import RobotBounds, robot_bounds


def _entries(
    gains: Gains, m: Scalar, K_I: Scalar, a: Scalar, b: Scalar
) -> tuple[Scalar, Scalar, Scalar, Scalar, Scalar]:
    """The entries of `Q` that are not zero: (1,1), (2,2), (1,3), (2,3), (3,3)."""
    g = gains
    return (
        g.alpha1 * g.k2 * K_I,
        g.alpha3 * g.k2 * K_I,
        m * (g.alpha1**2 * a - g.alpha2**2 * b) / 2,
        m * g.alpha2 * (g.alpha1 * a + g.alpha3 * b) / 2,
        m * (g.alpha2 * g.k1 - g.alpha1 * a),
    )


def Q(gains: Gains, m: float, K_I: float, a: float, b: float) -> np.ndarray:
    """Matrix of the decrease of ``V_m`` [W], 3 x 3, in ``(tanh(e_m), tanh(e_f), eta_m)``."""
    first, second, upper, lower, last = _entries(gains, m, K_I, a, b)
    return np.array([[first, 0.0, upper], [0.0, second, lower], [upper, lower, last]])


def schur_margin(gains: Gains, m: Scalar, K_I: Scalar, a: Scalar, b: Scalar) -> Scalar:
    """Schur complement of `Q` over ``m`` [1/s]; elementwise where arrays are given.

    ``z^T Q z`` is at least ``m`` times this times ``eta_m^2``, and that where the other two are
    at their worst.

    Parameters
    ----------
    gains : Gains
        The five that `Q` is made of.
    m, K_I : float or array
        Mass [kg] and contact stiffness [N/m].
    a, b : float or array
        ``sech^2`` of ``e_m`` and of ``e_f``, from 0 to 1.
    """
    first, second, upper, lower, last = _entries(gains, m, K_I, a, b)
    return (last - upper**2 / first - lower**2 / second) / m


def vtx_margin(gains: Gains, m: Scalar, K_I: Scalar) -> Scalar:
    """Margin of condition VTX [1/s]; elementwise where arrays are given.

    It is `schur_margin` at rest, the least over all states; positive if and only if VTX holds, and
    with it Proposition B. It grows with ``K_I / m`` and depends on nothing else of the plant.
    """
    return schur_margin(gains, m, K_I, 1.0, 1.0)


@dataclass(frozen=True)
class MassBounds:
    """Bounds in permanent contact from its first instant on, Proposition B with A."""

    margin: float
    """`vtx_margin` that they rest on [1/s]."""
    V_m: float
    """Upper bound of ``V_m`` [J]."""
    e_m: float
    """Upper bound of ``|e_m|`` [m]."""
    e_f: float
    """Upper bound of ``|e_f|``; ``|u_f|`` is at most its tanh."""
    eta_m: float
    """Upper bound of ``|eta_m|`` [m/s]."""
    F_m: float | None
    """Upper bound of the contact force [N]; None where it exceeds every number."""


def mass_obstacle(case: Case) -> str:
    """Why there are no bounds of Proposition B for a case; empty if there are."""
    if vtx_margin(case.law.gains, case.bounds.m_u, case.bounds.zeta_K[0]) <= 0:
        return "VTX fails at the largest mass and the softest contact of the assumptions"
    return "" if case.e.gap >= 0 else first_contact(case).undefined


def mass_bounds(case: Case) -> MassBounds | None:
    """Bounds over the assumptions, if contact is kept from the first touch; see `mass_obstacle`.

    Until then the mass rests, ``theta_dk_hat`` too, and ``u_f`` lies between its start and
    ``u_inf`` of Proposition C. The bounds are evaluated at the corners of what is admitted of
    ``u_f``, ``m``, ``K_I`` and ``theta_dk``. Each of ``V_m``, ``eta_m`` and the stored energy, from
    which ``e_m`` and ``e_f`` follow, is convex in the four one at a time, so that a corner is its
    worst; of ``F_m`` a search has found none worse in between, which is not a proof.
    """
    if mass_obstacle(case):
        return None
    law, b, robot, arm = case.law, case.bounds, robot_bounds(case), case.law.model.arm
    box = (float(law.theta_dk.lower), float(law.theta_dk.upper))  # type: ignore[arg-type]
    touches = (case.a.u_f, case.a.u_f if case.e.gap >= 0 else first_contact(case).u_inf)
    found = []
    for m, K_I, theta_dk, u_f in itertools.product((b.m_l, b.m_u), b.zeta_K, box, touches):
        body = MassSpring(m, theta_dk * K_I, law.model.body.x_0)
        corner = Plant(arm, body, LinearSpring(K_I=K_I))
        found.append(mass_bounds_of(corner, law, case.s, case.a._replace(u_f=u_f), robot))
    return _worst([bounds for bounds in found if bounds is not None])


def _worst(found: list[MassBounds]) -> MassBounds:
    forces = [bounds.F_m for bounds in found]
    known = [force for force in forces if force is not None]
    return MassBounds(
        margin=min(bounds.margin for bounds in found),
        V_m=max(bounds.V_m for bounds in found),
        e_m=max(bounds.e_m for bounds in found),
        e_f=max(bounds.e_f for bounds in found),
        eta_m=max(bounds.eta_m for bounds in found),
        F_m=max(known) if len(known) == len(forces) else None,
    )


def mass_bounds_of(
    plant: Plant, law: AdaptiveContactLaw, s: PlantState, a: AdaptiveState, robot: RobotBounds
) -> MassBounds | None:
    """The same with a known plant, from a state on in which contact begins; None if VTX fails."""
    m, K_I, k2 = plant.body.m, plant.contact.K_I, law.gains.k2
    margin = vtx_margin(law.gains, m, K_I)
    if margin <= 0:
        return None
    energy = float(V_m(plant, law, s, a)) + K_I**2 * robot.e_r1_squared / (4 * m * margin)
    farthest = _arcosh_exp(energy / (k2 * K_I))
    return MassBounds(
        margin=margin,
        V_m=energy,
        e_m=farthest,
        e_f=farthest,
        eta_m=float(np.sqrt(2 * energy / m)),
        F_m=largest_force(law, K_I, farthest, farthest, robot.e_r[0]),
    )


def _arcosh_exp(stored: float) -> float:
    """``x >= 0`` with ``ln cosh(x) = stored``, without overflow."""
    return float(stored + np.log1p(np.sqrt(-np.expm1(-2 * stored))))


def largest_force(
    law: AdaptiveContactLaw, K_I: float, e_m: float, e_f: float, e_r1: float
) -> float | None:
    """Bound [N] of ``F_m = K_I (x_rd1 - x_m - e_r1)``, from the three terms of (25) one by one."""
    u_f, x_md = float(np.tanh(e_f)), law.target.x_md
    if 1 - u_f**2 < np.finfo(float).eps * 8:
        return None
    reach = law.x_rd1(x_md - e_m, 0.0, 0.0) - (x_md - e_m)
    damping = law.x_rd1(x_md, -u_f, 0.0) - law.x_rd1(x_md, 0.0, 0.0)
    spring = max(
        law.x_rd1(x_m, 0.0, theta_dk) - law.x_rd1(x_m, 0.0, 0.0)
        for x_m in (x_md - e_m, x_md + e_m)
        for theta_dk in law.theta_dk.widened
    )
    return float(K_I * (reach + damping + spring + e_r1))
