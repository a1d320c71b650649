"""Theorem 1 at the numbers of a case."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import TypeVar

from alight.theory.case import Case
from alight.theory.condition import Condition, Constant
from alight.theory.theorem_1.contact import contact_conditions, contact_constants
from alight.theory.theorem_1.decay import decay
from alight.theory.theorem_1.design import Design, design_of
from alight.theory.theorem_1.formulas import Corrected, Formulas, Printed
from alight.theory.theorem_1.free_motion import free_motion_conditions, free_motion_constants
from alight.theory.theorem_1.infeasibility import joint_conditions
from alight.theory.theorem_1.nonlinear_damping import (
    damping_conditions,
    damping_constants,
    nonlinear_damping,
)
from alight.theory.theorem_1.reading import Reading, Theorem1

Line = TypeVar("Line", Condition, Constant)


def theorem_1(case: Case) -> Theorem1:
    """Evaluate Theorem 1 as printed and as corrected.

    The law is taken to be (32), whatever its feedback: the theorem speaks of no other.

    Raises
    ------
    AlightError
        If the boxes admit an inertia that is not positive definite.
    """
    design = design_of(case)
    return Theorem1(printed=evaluate(design, Printed()), corrected=evaluate(design, Corrected()))


def evaluate(design: Design, formulas: Formulas) -> Reading:
    """Evaluate the constants and conditions of one reading, (23)-(70)."""
    damping = nonlinear_damping(design)
    found = decay(design, formulas, damping.beta)
    constants = (
        *damping_constants(damping),
        *free_motion_constants(design, formulas, found),
        *contact_constants(design, found),
    )
    conditions = (
        *damping_conditions(design, formulas, damping),
        *free_motion_conditions(design, formulas, found),
        *contact_conditions(design, formulas, found),
    )
    return Reading(
        constants=tuple(_noted(c, c.symbol, formulas.notes) for c in constants),
        conditions=tuple(_noted(c, c.number, formulas.notes) for c in conditions),
        joint=joint_conditions(design, formulas),
    )


def _noted(line: Line, key: str, notes: Mapping[str, str]) -> Line:
    note = notes.get(key)
    return dataclasses.replace(line, meaning=f"{line.meaning} {note}") if note else line
