"""(64)-(70): the desired position leads the mass by more than the tip lags, so that they meet."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from alight.control.error_system import cosh2_tanh
from alight.symbolic.ops import tanh
from alight.theory.condition import Condition, Constant
from alight.theory.theorem_1.decay import Decay
from alight.theory.theorem_1.design import Design
from alight.theory.theorem_1.formulas import Formulas

SUPERFLUOUS = "Not needed to meet a mass at rest: Proposition C."


def contact_constants(d: Design, decay: Decay) -> tuple[Constant, ...]:
    """``epsilon_f`` of (64) and the bounds of ``e_m`` in (68) and (69)."""
    u_f = decay.u_f
    return (
        Constant(
            "eps_f",
            "(64)",
            None if u_f is None else float(np.arctanh(u_f)),
            "mixed",
            "What e_f and |e_r| shrink to in free motion: atanh(sqrt(eps_x / lambda)). The paper "
            "does not prove that they do (E12).",
            decay.undefined("eps_f"),
        ),
        Constant(
            "eps_m",
            "before (69)",
            d.e_m_rest,
            "m",
            "Lower bound of e_m in free motion, x_md - x_0: true of a mass at rest, not of one "
            "that swings (E17).",
        ),
        Constant(
            "eps_m_upper",
            "(68)",
            d.e_m_upper,
            "m",
            "Upper bound of e_m in free motion, x_md - zeta_xr, by (54).",
        ),
    )


def contact_conditions(d: Design, f: Formulas, decay: Decay) -> tuple[Condition, ...]:
    """(66), (67), (69) and (70), which is two."""
    printed_66 = "k2 (tanh(e_m) - k1 cosh(eps_f)^2 tanh(eps_f)) >= eps_f at e_m = x_md - x_0"
    ahead = "The desired position is ahead of a mass at rest by more than the tip lags behind it."
    alone, anywhere = "The same from (28) alone.", "The same wherever the mass may be."
    u_f, at_rest = decay.least_u_f, f.hindrance(d, d.e_m_rest)
    reach = _Reach(d, decay)
    return (
        reach.condition("(65), (66)", printed_66, ahead, cosh2_tanh(u_f), 0.0),
        reach.condition("(67)", f.statements["(67)"], alone, f.spread(u_f), at_rest),
        reach.condition(
            "(69)",
            f.statements["(69)"],
            f"{anywhere} {SUPERFLUOUS}",
            f.spread(u_f),
            f.hindrance(d, d.e_m_upper),
        ),
        _70a(d, f, decay),
        _70b(d, f, decay),
    )


def _lead(d: Design, spread: float) -> float:
    """What ``k2`` is multiplied by in (66), (67) and (69)."""
    return float(tanh(d.e_m_rest)) - d.gains.k1 * spread


@dataclass(frozen=True)
class _Reach:
    """Inequalities ``k2 (tanh(eps_m) - k1 spread) >= eps_f + hindrance`` [m]."""

    d: Design
    decay: Decay

    def condition(
        self, number: str, statement: str, meaning: str, spread: float, hindrance: float
    ) -> Condition:
        left = self.d.gains.k2 * _lead(self.d, spread)
        right = float(np.arctanh(self.decay.least_u_f)) + hindrance
        defined = self.decay.u_f is not None
        certain = f"the left side is at most {left:.3g}, the right at least {right:.3g}"
        return Condition(
            number,
            statement,
            left if defined else None,
            ">=",
            right if defined else None,
            "m",
            meaning,
            undefined=self.decay.undefined("eps_f", certain),
            fails=not defined and left < right,
        )


def _70a(d: Design, f: Formulas, decay: Decay) -> Condition:
    """Bound of ``k1``: the denominator of (70) is positive."""
    spread, w = f.spread(decay.least_u_f), float(tanh(d.e_m_rest))
    # printed, the factor divides the right side; corrected, it can be zero and stays on the left
    divides = f.spread(0.0) > 0
    left, right = (d.gains.k1, w / spread) if divides else (d.gains.k1 * spread, w)
    defined = decay.u_f is not None
    side = f"right side is at most {right:.3g}" if divides else f"left side is at least {left:.3g}"
    return Condition(
        "(70), k1",
        f.statements["(70), k1"],
        left if defined or divides else None,
        "<",
        right if defined or not divides else None,
        "",
        f"Only so is there a k2 for the other one. {SUPERFLUOUS}",
        undefined=decay.undefined("eps_f", f"the {side}"),
        fails=not defined and left >= right,
    )


def _70b(d: Design, f: Formulas, decay: Decay) -> Condition:
    """Bound of ``k2``."""
    u_f = decay.least_u_f
    lead = _lead(d, f.spread(u_f))
    load = float(np.arctanh(u_f)) + f.hindrance(d, d.e_m_upper)
    none = "no k2 will do: its factor in (69) is not positive, and (70) fails for k1"
    right, certain = None, none
    if lead > 0:
        right, certain = load / lead, f"the right side is at least {load / lead:.3g}"
    defined = decay.u_f is not None and right is not None
    return Condition(
        "(70), k2",
        f.statements["(70), k2"],
        d.gains.k2,
        ">=",
        right if defined else None,
        "m",
        f"(69) solved for k2. {SUPERFLUOUS}",
        undefined="" if defined else decay.undefined("eps_f", certain) or none,
        fails=not defined and (load > 0 if right is None else d.gains.k2 < right),
    )
