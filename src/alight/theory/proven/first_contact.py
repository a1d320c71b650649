"""Proposition C: from rest, contact comes in finite time, and by when at the latest.

Until contact the mass rests at ``x_0``: ``e_m = d`` and ``w = tanh(d) > 0`` are constant, ``Y_d``
is zero and ``theta_dk_hat`` of no effect. The filter obeys the scalar equation (18),

    u_dot = f(u) = (1 - u^2) (alpha2 w - alpha3 u) - k1 (alpha1 w + alpha2 u),

a cubic in ``u`` with ``f(-oo) < 0 < f(-1)``, ``f(1) < 0 < f(oo)`` where ``alpha1 w < alpha2``: just
one of its three roots, ``u_inf``, lies in (-1, 1), and every solution that starts there stays there
and tends to it, monotonically. At that root ``alpha2 k1 u / (1 - u^2) = alpha2 w - alpha3 u -
k1 alpha1 w / (1 - u^2)``, so that the lead of the desired position over the mass tends to

    s_inf = k2 (w - k1 u / (1 - u^2)) = k2 (alpha3 u / alpha2 + k1 alpha1 w / (alpha2 (1 - u^2)));

the first form is positive for ``u_inf <= 0``, the second for ``u_inf > 0``: ``s_inf > 0`` for all
positive gains.

As long as there is no contact ``x_r1 < x_m``, so that ``e_r1 > s(t) = x_rd1 - x_m``. Up to a time
``T`` before contact Proposition A then leaves two things to be paid for from ``R``:

- position: ``alpha_1 int max(s, 0) f(max(s, 0)) dt``, since ``e f(e)`` grows with ``e > 0``, ``f``
  being the feedback of a position error;
- velocity: ``r_r1 = e_r1_dot + alpha_1 e_r1`` has at least the mean
  ``rho = (s(T) - e_r1(0) + alpha_1 int s dt) / T``. With ``phi`` convex, even, and below ``r``
  times its feedback wherever ``|r| <= sup |r_r1|``, Jensen's inequality leaves ``T phi(rho)``.

Both grow without bound: contact comes no later than their sum reaches ``R``. The first alone gives
``R / (alpha_1 s_inf f(s_inf))`` for long times; the second, with ``phi(rho)`` near ``k3_1 |rho|``
for (32), ``R / (k3_1 alpha_1 s_inf)``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from alight.control import AdaptiveContactLaw, AdaptiveState
from alight.models import PlantState
from alight.theory.case import Case
from alight.theory.lyapunov import errors_at
from alight.theory.proven.filter_domain import filter_room
from alight.theory.proven.robot_part import RobotBounds, damping, holding, robot_bounds

SETTLED = 20.0
"""Time constants of the filter over which it is integrated."""

RESOLVED = 1e-7
"""Share of ``k1 k2`` below which the integrated filter does not resolve the lead."""


@dataclass(frozen=True)
class FirstContact:
    """When the tip touches the resting mass at the latest."""

    u_inf: float | None
    """Limit of the filter state before contact."""
    s_inf: float | None
    """Limit of the lead ``x_rd1 - x_m`` before contact [m]."""
    latest: float | None
    """Upper bound of the time of first contact [s]."""
    undefined: str = ""
    """Why there is no bound; empty if there is one."""


def first_contact(case: Case) -> FirstContact:
    """Bound the time of first contact over the boxes of ``theta_r``.

    Assumes, besides what it checks, that ``J`` stays regular and that no motor clips.
    """
    return first_contact_of(case.law, case.s, case.a, robot_bounds(case))


def first_contact_of(
    law: AdaptiveContactLaw, s: PlantState, a: AdaptiveState, robot: RobotBounds
) -> FirstContact:
    """The same from a state on for which Proposition A gives ``robot``."""
    x_0 = law.model.body.x_0
    if s.x_m != x_0 or s.x_m_dot:
        return FirstContact(None, None, None, "the mass does not start at rest at x_0")
    if law.target.x_md <= x_0:
        return FirstContact(None, None, None, "x_md does not lie beyond x_0")
    if filter_room(law.gains, law.target.x_md - x_0, 0.0) <= 0:
        return FirstContact(None, None, None, "u_f can reach 1: alpha1 tanh(e_m) >= alpha2")
    u_inf = resting_filter(law)
    if lead(law, u_inf) < RESOLVED * law.gains.k1 * law.gains.k2:
        return FirstContact(u_inf, None, None, "s_inf is too small to be told from zero")
    e = errors_at(law, s, a)
    latest = 0.0 if e.gap >= 0 else _latest(law, float(a.u_f), u_inf, float(e.e_r[0]), robot)
    return FirstContact(u_inf, lead(law, u_inf), latest)


def resting_filter_rate(law: AdaptiveContactLaw, u_f: float) -> float:
    """Rate (18) of the filter state [1/s] while the mass rests at ``x_0``."""
    _, rate, _ = law.filter_rates(law.model.body.x_0, 0.0, u_f, law.theta_dk.initial)
    return float(rate)


def lead(law: AdaptiveContactLaw, u_f: float) -> float:
    """``x_rd1 - x_m`` [m] while the mass rests at ``x_0``."""
    x_0 = law.model.body.x_0
    return float(law.x_rd1(x_0, u_f, law.theta_dk.initial) - x_0)


def resting_filter(law: AdaptiveContactLaw) -> float:
    """Where the filter state comes to rest before contact."""
    from scipy.optimize import brentq  # a third of a second, which an import need not cost

    return float(brentq(lambda u_f: resting_filter_rate(law, u_f), -1.0, 1.0, xtol=1e-15))


def _latest(
    law: AdaptiveContactLaw, u_f: float, u_inf: float, e_r1: float, robot: RobotBounds
) -> float:
    """Time [s] at which what is owed before contact reaches ``R``.

    The filter is followed for `SETTLED` of its time constants; thereafter the lead, which is
    monotonic, lies above the smaller of its value then and its limit.
    """
    from scipy.optimize import brentq

    followed, end = _followed(law, u_f, u_inf)
    minorant = _minorant(law, robot.r_r[0])
    least = min(u_inf, followed(end)[0], key=lambda u: lead(law, u))

    def unpaid(t: float) -> float:
        u, run, effort = followed(min(t, end))
        late = max(t - end, 0.0)
        at_end = lead(law, least if late else u)
        travelled = at_end - e_r1 + robot.alpha[0] * (run + late * lead(law, least))
        held = robot.alpha[0] * (effort + late * _effort(law, least))
        return robot.R - held - t * minorant(travelled / t)

    late = end
    while unpaid(late) > 0:
        late *= 2
    times = np.linspace(0.0, late, 513)[1:]
    i = int(np.argmax([unpaid(t) <= 0 for t in times]))
    return float(brentq(unpaid, times[i - 1], times[i])) if i else float(times[0])


def _effort(law: AdaptiveContactLaw, u_f: float) -> float:
    """Position error that the lead owes, times its feedback [N m]."""
    ahead = max(lead(law, u_f), 0.0)
    return ahead * holding(law, ahead)


def _followed(
    law: AdaptiveContactLaw, u_f: float, u_inf: float
) -> tuple[Callable[[float], np.ndarray], float]:
    """``u_f``, and the integrals of lead and effort, as functions of time up to an end [s]."""
    from scipy.integrate import solve_ivp

    step = 1e-6 * (1 - abs(u_inf))
    below, above = (resting_filter_rate(law, u_inf + side * step) for side in (-1, 1))
    end = SETTLED * 2 * step / (below - above)
    solution = solve_ivp(
        lambda _, y: [resting_filter_rate(law, y[0]), lead(law, y[0]), _effort(law, y[0])],
        (0.0, end),
        [u_f, 0.0, 0.0],
        rtol=1e-9,
        atol=1e-12,
        method="LSODA",
        dense_output=True,
    )
    return solution.sol, end


def _minorant(law: AdaptiveContactLaw, sup_r: float) -> Callable[[float], float]:
    """Convex function of ``r_r1`` below ``r_r1`` times its feedback [W], up to ``sup_r`` [m/s].

    The greatest of a fan of straight lines, each shifted below a staircase that lies below the
    power wherever that does not fall with ``r_r1``.
    """
    r = np.unique([*np.linspace(0.0, sup_r, 1500), *np.geomspace(1e-6 * sup_r, sup_r, 1500)])
    power = np.array([x * damping(law, 0, x) for x in r])
    slopes = np.diff(power[::5]) / np.diff(r[::5])
    corners = power[:-1] - slopes[:, None] * r[1:]
    heights = corners.min(axis=1)
    return lambda rho: max(0.0, float((slopes * rho + heights).max()))
