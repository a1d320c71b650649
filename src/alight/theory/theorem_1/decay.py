"""``lambda`` of (57) and ``V_u`` of (39): each is made of the other.

(57) holds with every ``lambda <= T(lambda) = min{beta, alpha, g(lambda)}``, where ``g`` is the
least of ``k3 - (sqrt(2 V_u(lambda) / a1) + 1)^2 / alpha`` and ``V_u(lambda)`` the larger of the
bound of ``V(0)`` and ``c lambda_1 atanh(sqrt(eps_x / lambda))^2 + zeta_theta``; it needs
``lambda > eps_x``. The largest one is wanted: it makes ``V_u`` least.

``F(lambda) = lambda - g(lambda)`` is convex. For ``sqrt(eps_x / lambda)`` is convex in ``lambda``,
``h = atanh`` of it too, as a convex growing function of a convex one, and so are ``h^2``,
``sqrt(A + B h^2)`` and what is made of them with positive weights. So where
``F(lambda) <= 0`` holds at all it holds on an interval; what is wanted is its upper end, or
``min{beta, alpha}`` if that is smaller.

Let ``F`` be positive at ``p = min{beta, alpha}`` and at ``q = T(p) < p``. No solution lies above
``q``, since ``T`` does not fall: ``lambda <= p`` gives ``lambda <= T(lambda) <= T(p)``. Convex
``F`` lies above its chord through ``p`` and ``q`` everywhere outside ``[q, p]``. Where the chord
rises, its zero is therefore above every solution, and below ``q``: take it for the next ``q``.
Where it does not rise, ``F`` is positive on all of the left, and there is no solution. So the
iterates fall, no solution lies above any of them, and their limit, a zero of ``F``, is the largest.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from alight.theory.theorem_1.design import Design
from alight.theory.theorem_1.formulas import Formulas

RESOLVED = 1e-12
"""How far above ``eps_x`` a ``lambda`` must be, relatively, to be told from it."""


@dataclass(frozen=True)
class Decay:
    """The rate of (57), or why there is none."""

    epsilon_x: float
    ceiling: float
    """``min{beta, alpha}`` [W]: more than that ``lambda`` cannot be."""
    rate: float | None
    """``lambda`` [W]."""
    reason: str
    """Why there is none; empty if there is one."""

    def undefined(self, symbol: str, certain: str = "") -> str:
        """Why a quantity made of ``lambda`` has no value, and what is certain all the same."""
        if self.rate is not None:
            return ""
        return f"{symbol} is undefined: {self.reason}" + (f"; {certain}" if certain else "")

    @property
    def possible(self) -> bool:
        """Whether ``eps_x`` is below what ``lambda`` can be at most."""
        return self.epsilon_x < self.ceiling * (1 - RESOLVED)

    @property
    def u_f(self) -> float | None:
        """``sqrt(eps_x / lambda)``, the ``tanh(epsilon_f)`` of (64)."""
        return None if self.rate is None else float(np.sqrt(self.epsilon_x / self.rate))

    @property
    def least_u_f(self) -> float:
        """What that is at least; 0 where nothing is known of it."""
        if self.rate is not None:
            return float(np.sqrt(self.epsilon_x / self.rate))
        return float(np.sqrt(self.epsilon_x / self.ceiling)) if self.possible else 0.0


def V_inside(d: Design, f: Formulas, u_f: float) -> float:
    """Bound of ``V`` where ``lambda |y|^2 <= eps_x`` [J], (61) in (48); ``u_f`` as in `Decay`."""
    return f.inside * f.lambda_1(d) * float(np.arctanh(u_f)) ** 2 + f.zeta_theta(d)


def V_u(d: Design, f: Formulas, u_f: float) -> float:
    """``V_u`` after (62) [J]."""
    return max(f.V_start(d), V_inside(d, f, u_f))


def needed(d: Design, V: float) -> float:
    """Right side of (56) at a value of ``V`` [J]."""
    return float((np.sqrt(2 * V / d.inertia.a1) + 1) ** 2)


def decay(d: Design, f: Formulas, beta: float) -> Decay:
    """Solve for the largest ``lambda``; say why where there is none."""
    epsilon_x = f.epsilon_x(d)
    axes = f.axes(d)
    ceiling = min(beta, *(alpha for _, alpha in axes))
    unsolved = Decay(epsilon_x, ceiling, None, "eps_x >= min{beta, alpha} >= lambda")
    if not unsolved.possible:
        return unsolved

    def excess(rate: float) -> float:
        load = needed(d, V_u(d, f, float(np.sqrt(epsilon_x / rate))))
        return rate - min(k3 - load / alpha for k3, alpha in axes)

    rate = _largest(excess, epsilon_x / (1 - RESOLVED), ceiling)
    why = "no lambda > eps_x satisfies lambda <= k3 - (sqrt(2 V_u / a1) + 1)^2 / alpha"
    return Decay(epsilon_x, ceiling, rate, why if rate is None else "")


def _largest(F: Callable[[float], float], above: float, at_most: float) -> float | None:
    """Largest number of ``(above, at_most]`` at which the convex ``F`` is not positive."""
    p, F_p = at_most, F(at_most)
    if F_p <= 0:
        return p
    q = p - F_p
    while q > above:
        F_q = F(q)
        if F_q <= 0:
            return q
        if F_q >= F_p:
            return None
        following = q - F_q * (p - q) / (F_p - F_q)
        if following >= q:  # rounding: F is zero there to the last digit
            return q
        p, F_p, q = q, F_q, following
    return None
