"""The steady-state errors that the paper prints."""

from __future__ import annotations

from typing import NamedTuple


class SteadyState(NamedTuple):
    """Peak steady-state errors of an experiment [m]."""

    e_r1: float
    e_r2: float
    e_m: float


EXPERIMENT_1 = SteadyState(0.216e-3, 0.737e-3, 2.56e-6)
"""Section V-A."""
EXPERIMENT_2 = SteadyState(0.376e-3, 0.075e-3, 5e-6)
"""Section V-B."""
