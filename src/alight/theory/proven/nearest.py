"""The gains nearest to given ones that satisfy VTX and keep the filter within its domain.

In the logarithms of the gains this is a projection onto a convex set, and so has one solution and
no other local minimum. What ``alpha2 k1`` must exceed in VTX is

    alpha1 + c (alpha1^3 + alpha2^2 alpha3 + alpha1^2 alpha2^2 / alpha3 + alpha2^4 / alpha1),

``c = m / (4 k2 K_I)``: a sum of products of powers with positive factors. Each, divided by
``alpha2 k1``, is the exponential of a linear function of the logarithms, so that the share of VTX
is 1 less a convex function of them. The share of the filter's domain, 1 less a multiple of
``alpha1 / alpha2``, is as well.
"""

from __future__ import annotations

import itertools

import numpy as np

from alight.control import Gains
from alight.errors import AlightError
from alight.symbolic.parameters import rebind
from alight.theory.case import Case
from alight.theory.proven.contact import vtx_margin
from alight.theory.proven.filter_domain import filter_room

FREE = ("k1", "k2", "alpha1", "alpha2", "alpha3")
"""The gains that VTX speaks of."""
DIGITS = 3
NEIGHBOURS = 2
"""Numbers of three digits tried on each side of each gain."""
SPAN = 12.0
"""Furthest that the logarithm of a gain is moved."""


def nearest_vtx(gains: Gains, m: float, K_I: float, e_m: float) -> Gains:
    """Gains nearest to the given ones, in the logarithms of `FREE`, that satisfy VTX.

    They also keep ``|u_f| < 1`` while the mass rests. Rounded to three digits so that both still
    hold; given ones that satisfy both are returned as they are.

    Parameters
    ----------
    gains : Gains
        Where to start from; the others than `FREE` stay.
    m, K_I : float
        Mass [kg] and contact stiffness [N/m]: the largest and the smallest that are admitted.
    e_m : float
        Position error of the mass before contact [m].

    Raises
    ------
    AlightError
        If none is found.
    """
    if _holds(gains, m, K_I, e_m):
        return gains
    given = np.log([getattr(gains, name) for name in FREE])
    found = _projected(gains, given, m, K_I, e_m)
    rounded = None if found is None else _rounded(gains, given, found, m, K_I, e_m)
    if rounded is None:
        raise AlightError(
            f"no gains near the given ones satisfy VTX at m = {m:g} kg, K_I = {K_I:g} N/m and keep "
            "the filter in its domain"
        )
    return rounded


def nearest_vtx_of(case: Case) -> Gains:
    """`nearest_vtx` at the worst of the assumptions: the largest mass, the softest contact."""
    b = case.bounds
    return nearest_vtx(case.law.gains, b.m_u, b.zeta_K[0], float(case.e.e_m))


def _with(gains: Gains, x: np.ndarray) -> Gains:
    """Gains at logarithms of shape (5, ...)."""
    return rebind(gains, **dict(zip(FREE, np.exp(x), strict=True)))


def _sides(gains: Gains, m: float, K_I: float, e_m: float) -> np.ndarray:
    """Margins of VTX and of the filter's domain, as shares of the left sides; shape (2, ...)."""
    vtx = vtx_margin(gains, m, K_I) / (gains.alpha2 * gains.k1)
    return np.array([vtx, filter_room(gains, e_m, 0.0) / gains.alpha2])


def _holds(gains: Gains, m: float, K_I: float, e_m: float) -> bool:
    return bool((_sides(gains, m, K_I, e_m) > 0).all())


def _projected(
    gains: Gains, given: np.ndarray, m: float, K_I: float, e_m: float
) -> np.ndarray | None:
    """Nearest logarithms on the border, far more exact than their rounding; None if not found."""
    from scipy.optimize import minimize  # a third of a second, which an import need not cost

    inside = {"type": "ineq", "fun": lambda x: _sides(_with(gains, x), m, K_I, e_m)}
    found = minimize(
        lambda x: np.sum((x - given) ** 2),
        given,
        jac=lambda x: 2 * (x - given),
        bounds=[(x - SPAN, x + SPAN) for x in given],
        constraints=[inside],
        method="SLSQP",
        options={"maxiter": 300, "ftol": 1e-8},
    )
    return found.x if found.success else None


def _rounded(
    gains: Gains, given: np.ndarray, best: np.ndarray, m: float, K_I: float, e_m: float
) -> Gains | None:
    """Nearest gains of three digits about the best, that satisfy both conditions."""
    choices = []
    for x, x_given in zip(best, given, strict=True):
        value = float(np.exp(x))
        digit = 10.0 ** (np.floor(np.log10(value)) - DIGITS + 1)
        around = [round(value / digit) + i for i in range(-NEIGHBOURS, NEIGHBOURS + 1)]
        decimals = int(-np.log10(digit) + 0.5) if digit < 1 else 0
        choices.append([*(round(n * digit, decimals) for n in around), float(np.exp(x_given))])
    tried = np.array(list(itertools.product(*choices))).T
    inside = (_sides(_with(gains, np.log(tried)), m, K_I, e_m) > 0).all(axis=0)
    if not inside.any():
        return None
    distance = np.where(inside, np.sum((np.log(tried) - given[:, None]) ** 2, axis=0), np.inf)
    chosen = tried[:, distance.argmin()]
    return rebind(gains, **dict(zip(FREE, map(float, chosen), strict=True)))
