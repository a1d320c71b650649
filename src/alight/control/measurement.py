"""What a law may know of the plant at a sample, and nothing else (Assumption 3)."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

from alight.symbolic.signals import Signal


class Measurement(NamedTuple):
    """Positions and velocities; there is no force and no acceleration to read."""

    q: Annotated[Any, Signal("rad", "measured joint angles", 2)]
    q_dot: Annotated[Any, Signal("rad/s", "joint rates, from the measured angles", 2)]
    x_m: Annotated[Any, Signal("m", "measured position of the mass")]
    x_m_dot: Annotated[Any, Signal("m/s", "velocity of the mass, from its measured position")]
