"""A search for gains and a mass that satisfy (26), (37), (38) and (70) together."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from alight.control import Estimate, Gains
from alight.scenarios.assumptions import Assumptions
from alight.theory.condition import Condition
from alight.theory.inertia import InertiaBounds
from alight.theory.theorem_1.design import Design
from alight.theory.theorem_1.evaluate import evaluate
from alight.theory.theorem_1.formulas import Formulas
from alight.theory.theorem_1.infeasibility import stiffness_limit
from alight.theory.theorem_1.reading import Reading

SOUGHT = ("(26)", "(37)", "(38), first", "(38), second", "(70), k1", "(70), k2")
DECADES = ((-4.0, 3.0), (0.0, 8.0), (-8.0, 2.0), (-4.0, 3.0), (-8.0, 2.0), (-3.0, 4.0))
"""Powers of ten between which ``k1, k2, alpha1, alpha2, alpha3, m_l`` are sought, in SI units."""
NARROW = 1 + 1e-9
"""Upper over lower bound of what is not known: nothing favours the conditions more."""


@dataclass(frozen=True)
class Attempt:
    """The best design that a search found."""

    design: Design
    margin: float
    """Least margin of its conditions, each over the sum of the magnitudes of both sides."""
    tried: int
    """Number of designs that were evaluated."""


def search_for_a_feasible_design(
    formulas: Formulas, product_over_limit: float, seed: int, generations: int = 60
) -> Attempt:
    """Maximise the least margin of (26), (37), (38) and (70) by differential evolution.

    The contact is ``product_over_limit`` times as stiff as the joint inequality admits at most; the
    set point lies 30 mm beyond the rest position, as in (41). ``alpha`` and ``k3`` are so large
    that they decide nothing, and the bounds of Assumption 2 so narrow that they cost nothing.
    """
    from scipy.optimize import differential_evolution  # slow to import, and needed here alone

    def cost(powers: np.ndarray) -> float:
        design = _design(formulas, product_over_limit, powers)
        return -_least_margin(evaluate(design, formulas))

    best = differential_evolution(
        cost,
        DECADES,
        seed=np.random.default_rng(seed),
        maxiter=generations,
        popsize=10,
        tol=0.0,
        polish=False,
    )
    design = _design(formulas, product_over_limit, best.x)
    return Attempt(design, -float(best.fun), int(best.nfev))


def _design(formulas: Formulas, product_over_limit: float, powers: np.ndarray) -> Design:
    k1, k2, alpha1, alpha2, alpha3, m_l = (float(v) for v in 10.0**powers)
    large = (1e9, 1e9)
    ideal = Design(
        gains=Gains(k1, k2, (1e30, 1e30), alpha1, alpha2, alpha3, large, Gamma=1.0),
        bounds=_bounds(m_l, 1.0),
        inertia=InertiaBounds(1.0, 1.0),
        x_md=0.236,
        x_0=0.206,
        theta_dk=Estimate(1.0, 1.0, NARROW),
        theta_r=Estimate((1.0,), (1.0,), (NARROW,)),
        Gamma_r=(1.0,),
        z_bar=0.0,
        V_0=0.0,
    )
    stiffness = product_over_limit * stiffness_limit(ideal, formulas)
    return dataclasses.replace(ideal, bounds=_bounds(m_l, stiffness))


def _bounds(m_l: float, stiffness: float) -> Assumptions:
    spring = (stiffness / NARROW, stiffness)
    return Assumptions(m_l, m_l * NARROW, spring, spring, -0.5, 0.25, 0.05)


def _least_margin(reading: Reading) -> float:
    """Least normalised margin.

    Below -1, where ``lambda`` does not exist: how far it is from it. Below -2, where there is no
    ``k_n1``: how far (26) is from holding.
    """
    damping = _normalised(reading.condition("(26)"))
    if damping <= 0 or not reading.condition("(37)").holds:
        return damping - 2
    if reading.constant("lambda").value is None:
        beta, epsilon_x = (reading.constant(name).value or 0.0 for name in ("beta", "eps_x"))
        return (beta - epsilon_x) / (beta + epsilon_x) - 1
    return min(_normalised(reading.condition(number)) for number in SOUGHT)


def _normalised(condition: Condition) -> float:
    left, right, margin = condition.left, condition.right, condition.margin
    if left is None or right is None or margin is None:
        return 0.0  # (70) for k2 without a right side: that for k1 fails then, and tells how far
    return margin / (abs(left) + abs(right))
