"""Theorem 1 of the paper: its conditions as printed and as corrected."""

from alight.theory.theorem_1.design import Design, design_of
from alight.theory.theorem_1.evaluate import evaluate, theorem_1
from alight.theory.theorem_1.formulas import Corrected, Formulas, Printed
from alight.theory.theorem_1.free_motion import alpha2_floor
from alight.theory.theorem_1.infeasibility import joint_conditions, stiffness_limit
from alight.theory.theorem_1.nonlinear_damping import zeta_1
from alight.theory.theorem_1.reading import Reading, Theorem1
from alight.theory.theorem_1.search import Attempt, search_for_a_feasible_design

__all__ = [
    "Attempt",
    "Corrected",
    "Design",
    "Formulas",
    "Printed",
    "Reading",
    "Theorem1",
    "alpha2_floor",
    "design_of",
    "evaluate",
    "joint_conditions",
    "search_for_a_feasible_design",
    "stiffness_limit",
    "theorem_1",
    "zeta_1",
]
