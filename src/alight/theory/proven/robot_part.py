"""Proposition A: what the robot part of (47) bounds, for every positive gain and any contact.

Along the continuous closed loop, in contact, out of it and through switching,

    V_r_dot <= -dissipation = -r_r^T k3 Tanh(r_r) - e_r^T alpha Tanh(e_r) <= 0,

by (35), the skew symmetry of Property 2, (17), and the property of the projection that it never
adds to ``theta_tilde^T Gamma_r^-1 theta_tilde``. ``V_r`` does not hold ``Lambda``, and is
continuous when contact begins or ends. Hence, as long as the solution exists and ``J`` is regular:

- ``V_r(t) <= R`` for any ``R >= V_r(0)``. Each of its three parts is nonnegative, so that
  ``r_ri^2 <= 2 R (M_bar^-1)_ii`` and ``potential(e_r) <= R``;
- the integral of each term of the dissipation is at most ``R``. With ``f`` the feedback along one
  axis, ``r / f(r)`` does not fall with ``|r|`` (it is ``r / (k3 tanh r)`` for (32), ``1 / k3`` for
  (44)), so that ``int r_ri^2 dt <= R sup |r_ri| / f(sup |r_ri|)``, and likewise for ``e_ri``;
- ``e_ri_dot = r_ri - alpha_i e_ri``, so that ``|e_ri|`` stays between its start and
  ``sup |r_ri| / alpha_i``, which it nears exponentially, and by Cauchy and Schwarz below
  ``sqrt(e_ri(0)^2 + int r_ri^2 / (2 alpha_i))``. Times ``e_ri`` and integrated,
  ``2 alpha_i |e|^2 <= e_ri(0)^2 + 2 |e| |r|`` in the norms of square integrable functions.

The torque must reach the joints as computed: a motor that clips voids all of this.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from alight.control import AdaptiveContactLaw, AdaptiveState
from alight.models import Plant, PlantState
from alight.symbolic.parameters import rebind
from alight.theory.case import Case
from alight.theory.condition import Condition
from alight.theory.inertia import inertia_bounds, inertia_box
from alight.theory.lossless import lossless
from alight.theory.lyapunov import V_r, errors_at

REGULAR = 1e-3
"""Smallest singular value of ``J`` [m] in a sweep over poses; ``a1`` does not depend on it."""


@dataclass(frozen=True)
class RobotBounds:
    """Bounds of the tracking errors over a whole run, Proposition A."""

    R: float
    """Upper bound of ``V_r`` at the start [J], and so ever after."""
    alpha: tuple[float, float]
    """Gains of (17) [1/s]."""
    e_r_start: tuple[float, float]
    """``|e_ri(0)|`` [m]."""
    r_r: tuple[float, float]
    """Upper bound of each ``|r_ri(t)|`` [m/s]."""
    r_r_squared: tuple[float, float]
    """Upper bound of the integral of each ``r_ri^2`` [m^2/s]."""
    e_r_potential: tuple[float, float]
    """Upper bound of each ``|e_ri(t)|`` from the potential alone [m]."""
    e_r: tuple[float, float]
    """Upper bound of each ``|e_ri(t)|`` over all times [m], the least of three."""
    e_r1_effort: float
    """Upper bound of the integral of ``e_r1`` times its feedback [N m s]: ``R / alpha_1``."""
    e_r1_squared: float
    """Upper bound of the integral of ``e_r1^2`` [m^2 s], the less of two."""

    def e_r_at(self, t: float | np.ndarray) -> np.ndarray:
        """Upper bound of each ``|e_ri|`` at given times [s] after the start [m], shape (2, ...)."""
        rows = []
        for i, alpha in enumerate(self.alpha):
            fading = np.exp(-alpha * np.asarray(t, dtype=float))
            filtered = (1 - fading) * self.r_r[i] / alpha
            driven = np.sqrt(self.r_r_squared[i] * (1 - fading**2) / (2 * alpha))
            latest = fading * self.e_r_start[i] + np.minimum(filtered, driven)
            rows.append(np.minimum(latest, self.e_r_potential[i]))
        return np.array(rows)


def robot_bounds(case: Case) -> RobotBounds:
    """Bounds of Proposition A for every truth in the boxes of ``theta_r``, (34)."""
    return _bounds(case.law, case.s, case.a, largest_V_r(case), case.inertia.mobility)


def robot_bounds_of(
    plant: Plant, law: AdaptiveContactLaw, s: PlantState, a: AdaptiveState
) -> RobotBounds:
    """The same with a known plant, from any state on: ``R`` is ``V_r`` there."""
    p = np.array([getattr(plant.arm, name) for name in plant.arm.inertial])
    mobility = inertia_bounds(plant.arm, p, p, REGULAR).mobility
    return _bounds(law, s, a, float(V_r(plant, law, s, a)), mobility)


def largest_V_r(case: Case) -> float:
    """Largest ``V_r`` at the start over the boxes of ``theta_r`` [J].

    ``V_r`` is linear in the inertias, which are known up to their box, plus a convex square of the
    error of each entry: its largest value lies on a corner of the box, and entries other than the
    inertias take the end that is farther from the first estimate.
    """
    law, a = case.law, case.a
    plant = lossless(law.model)
    inertial = plant.arm.inertial
    rows = np.arange(2, 3 * len(inertial), 3)
    lower, upper = np.array(law.theta_r.lower), np.array(law.theta_r.upper)
    farthest = np.maximum(upper - a.theta_r_hat, a.theta_r_hat - lower)
    found = []
    for corner in itertools.product(*zip(*inertia_box(law), strict=True)):
        arm = rebind(plant.arm, **dict(zip(inertial, corner, strict=True)))
        moved = Plant(arm, plant.body, plant.contact)
        theta_tilde = farthest.copy()
        theta_tilde[rows] = np.array(corner) - a.theta_r_hat[rows]
        truth = np.asarray(law.theta_r_of(law.pi_of(moved)))
        found.append(float(V_r(moved, law, case.s, a._replace(theta_r_hat=truth - theta_tilde))))
    return max(found)


def tracking_conditions(case: Case) -> tuple[Condition, ...]:
    """Per-axis replacement of (39), without a square, a ``lambda`` or a circle.

    In (50) ``e_r^T e_r`` adds ``2 e_ri r_ri - 2 alpha_i e_ri^2`` to ``V_r_dot``, which is at most
    ``r_ri^2 / alpha_i - alpha_i e_ri^2``; the feedback of ``r_ri`` outweighs the first term where
    ``k3_i alpha_i > r_ri / tanh(r_ri)``, for every ``|r_ri|`` that Proposition A admits. The
    quotient is at most ``|r_ri| + 1``.

    For ``V_r + e_r^T e_r`` alone half of the right side would do, as ``2 e_ri r_ri - 2 alpha_i
    e_ri^2 <= r_ri^2 / (2 alpha_i)``. The factor 1 keeps one ``alpha_i e_ri^2``, as (53) does,
    against the coupling ``K_I |eta_m| |e_r1|`` with the mass.
    """
    law, bounds = case.law, robot_bounds(case)
    ratios = [
        law.gains.k3[i] * bounds.r_r[i] / damping(law, i, bounds.r_r[i]) if bounds.r_r[i] else 1.0
        for i in range(2)
    ]
    return tuple(
        Condition(
            number=f"A, axis {i + 1}",
            statement=f"k3_{i + 1} alpha_{i + 1} > k3_{i + 1} r / f(r), r = sup |r_r{i + 1}|",
            left=law.gains.k3[i] * law.gains.alpha[i],
            relation=">",
            right=ratios[i],
            unit="N/s",
            meaning=(
                f"Replaces (39) on axis X{i + 1}: V with its term e_r^T e_r still falls, and one "
                f"alpha_{i + 1} e_r{i + 1}^2 is kept for the coupling with the mass, as in (53); "
                "without the mass half of the right side would do. f is the feedback of r_r, and "
                "V_r falls with or without this."
            ),
        )
        for i in range(2)
    )


def damping(law: AdaptiveContactLaw, axis: int, r_r: float) -> float:
    """Feedback along one axis [N] of a filtered tracking error there [m/s]."""
    return float(law.feedback(np.zeros(2), np.eye(2)[axis] * r_r)[axis])


def holding(law: AdaptiveContactLaw, e_r1: float) -> float:
    """Feedback along X1 [N] of a position error there [m], without velocity error."""
    return float(law.feedback(np.array([e_r1, 0.0]), np.zeros(2))[0])


def _bounds(
    law: AdaptiveContactLaw, s: PlantState, a: AdaptiveState, R: float, mobility: float
) -> RobotBounds:
    start, alpha = np.abs(np.array(errors_at(law, s, a).e_r, dtype=float)), law.gains.alpha
    sup_r = float(np.sqrt(2 * R * mobility))
    squared = [R * sup_r / damping(law, i, sup_r) if sup_r else 0.0 for i in range(2)]
    potential = [_reach(law, R, i) for i in range(2)]
    e_r = [
        min(
            max(start[i], sup_r / alpha[i]),
            np.sqrt(start[i] ** 2 + squared[i] / (2 * alpha[i])),
            potential[i],
        )
        for i in range(2)
    ]
    held = e_r[0] / holding(law, e_r[0]) * R / alpha[0] if e_r[0] else 0.0
    driven = np.sqrt(squared[0]) + np.sqrt(squared[0] + 2 * alpha[0] * start[0] ** 2)
    return RobotBounds(
        R=R,
        alpha=alpha,
        e_r_start=_pair(start),
        r_r=(sup_r, sup_r),
        r_r_squared=_pair(squared),
        e_r_potential=_pair(potential),
        e_r=_pair(e_r),
        e_r1_effort=R / alpha[0],
        e_r1_squared=float(min(held, (driven / (2 * alpha[0])) ** 2)),
    )


def _pair(values: Sequence[float] | np.ndarray) -> tuple[float, float]:
    return float(values[0]), float(values[1])


def _reach(law: AdaptiveContactLaw, energy: float, axis: int) -> float:
    """Error of one axis [m] whose potential is the given energy [J]."""
    from scipy.optimize import brentq  # a third of a second, which an import need not cost

    def missing(e: float) -> float:
        return float(law.potential(np.eye(2)[axis] * e)) - energy

    far = 1.0
    while missing(far) < 0:
        far *= 2
    tolerance = 1e-12 * far
    return float(brentq(missing, 0.0, far, xtol=tolerance)) + tolerance  # on the safe side
