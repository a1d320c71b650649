"""What is proven of a scenario: Lyapunov functions, conditions, bounds, certificates."""

from alight.theory.certificate import Certificate, check
from alight.theory.condition import Condition, Constant
from alight.theory.inspection import inspect
from alight.theory.lyapunov import V, V_m, V_r
from alight.theory.page import page, tables
from alight.theory.proven import (
    LocalStability,
    linearise,
    loc_adapting_margin,
    loc_margin,
    nearest_vtx,
    vtx_margin,
)
from alight.theory.theorem_1 import alpha2_floor

__all__ = [
    "Certificate",
    "Condition",
    "Constant",
    "LocalStability",
    "V",
    "V_m",
    "V_r",
    "alpha2_floor",
    "check",
    "inspect",
    "linearise",
    "loc_adapting_margin",
    "loc_margin",
    "nearest_vtx",
    "page",
    "tables",
    "vtx_margin",
]
