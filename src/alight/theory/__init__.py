"""Lyapunov functions, stability conditions, and a look at every signal of a law."""

from alight.theory.conditions import alpha2_floor
from alight.theory.inspection import inspect
from alight.theory.local_stability import LocalStability, linearise, loc_margin
from alight.theory.lyapunov import V, V_m, V_r

__all__ = [
    "LocalStability",
    "V",
    "V_m",
    "V_r",
    "alpha2_floor",
    "inspect",
    "linearise",
    "loc_margin",
]
