"""(23), (26), (37) and ``beta``: how far ``k1`` must outweigh what the filter leaves over.

``chi`` of (22) over ``m`` is affine in ``a = sech^2(e_m)`` and ``b = sech^2(e_f)`` for a given
``z`` and linear in ``z``: ``chi / m = alpha1 a eta_m + (alpha2^2 b - alpha1^2 a) tanh(e_m)
- (alpha1 alpha2 a + alpha2 alpha3 b) tanh(e_f)``. By Cauchy and Schwarz ``|chi| / |z|`` is at most
``m`` times the norm of its three coefficients, which is convex in ``(a, b)``: largest at a vertex
of the unit square, and 0 at (0, 0). The vertex (1, 1) is attained, as ``z`` tends to zero along the
coefficients; at the other two the rule is a bound.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from alight.control import Gains
from alight.theory.condition import Condition, Constant
from alight.theory.theorem_1.design import Design
from alight.theory.theorem_1.formulas import Formulas

NO_K_N1 = "no k_n1 satisfies (26) and (37) together: evaluated with twice the floor of (37)"


def zeta_1(gains: Gains, m_u: float) -> float:
    """``zeta_1`` of (23) by the rule of vertices [N]; ``m_u`` [kg] bounds the mass from above."""
    g = gains
    rows = [
        (
            g.alpha1 * a,
            g.alpha2**2 * b - g.alpha1**2 * a,
            g.alpha1 * g.alpha2 * a + g.alpha2 * g.alpha3 * b,
        )
        for a, b in ((1, 0), (0, 1), (1, 1))
    ]
    return m_u * float(np.linalg.norm(rows, axis=1).max())


@dataclass(frozen=True)
class NonlinearDamping:
    """The gain ``k_n1`` of the proof, and what it leaves."""

    zeta_1: float
    slowest: float
    """``min{alpha1 k2 zeta_K, alpha3 k2 zeta_K, alpha2}`` of (37) [W]."""
    floor: float
    """Right side of (37)."""
    largest: float
    """Largest ``k_n1`` that (26) allows."""
    k1_floor: float
    """Right side of (26) at the floor of (37)."""

    @property
    def exists(self) -> bool:
        """Whether some ``k_n1`` satisfies (26) and (37)."""
        return self.largest > self.floor

    @property
    def k_n1(self) -> float:
        """The one that everything else is evaluated with."""
        return self.largest if self.exists else 2 * self.floor

    @property
    def beta(self) -> float:
        """Decrease of the mass part [W], after (53): it grows with ``k_n1``."""
        return self.slowest * (1 - self.floor / self.k_n1)


def nonlinear_damping(d: Design) -> NonlinearDamping:
    """``k_n1`` is used by the proof alone: take the largest that the gains allow."""
    g, b = d.gains, d.bounds
    stored = g.k2 * b.zeta_K[0]
    slowest = min(g.alpha1 * stored, g.alpha3 * stored, g.alpha2)
    floor = 1 / (4 * g.alpha2 * slowest)
    bound = zeta_1(g, b.m_u)
    return NonlinearDamping(
        zeta_1=bound,
        slowest=slowest,
        floor=floor,
        largest=(g.k1 * b.m_l - 3) / bound**2,
        k1_floor=(3 + floor * bound**2) / b.m_l,
    )


def damping_constants(n: NonlinearDamping) -> tuple[Constant, ...]:
    """``zeta_1``, ``k_n1`` and ``beta``."""
    chosen = "The largest that (26) allows." if n.exists else f"Here {NO_K_N1}."
    return (
        Constant(
            "zeta_1",
            "(23)",
            n.zeta_1,
            "N",
            "Bounds |chi| by zeta_1 |z|; the paper says only that it exists. Here by the rule of "
            "vertices, with m_u.",
        ),
        Constant("k_n1", "(26)", n.k_n1, "mixed", f"A gain that the proof alone uses. {chosen}"),
        Constant(
            "beta",
            "after (53)",
            n.beta,
            "W",
            "How fast V falls at least, per |z|^2; it needs the lower bound of K_I.",
        ),
    )


def damping_conditions(d: Design, f: Formulas, n: NonlinearDamping) -> tuple[Condition, ...]:
    """(26) and (37)."""
    chosen = "k_n1 is chosen so." if n.exists else f"But {NO_K_N1}."
    return (
        Condition(
            "(26)",
            f.statements["(26)"],
            d.gains.k1,
            ">",
            n.k1_floor,
            "",
            "k1 outweighs what the filter leaves of the mass dynamics; the right side is at the "
            "floor of (37), so that this fails just where no k_n1 will do. The 3 stands for 3 kg.",
        ),
        Condition(
            "(37)",
            "k_n1 > 1 / (4 alpha2 min{alpha1 k2 zeta_K, alpha3 k2 zeta_K, alpha2})",
            n.k_n1,
            ">",
            n.floor,
            "mixed",
            "Makes beta positive. It compares N/s with 1/s and so depends on the units. " + chosen,
        ),
    )
