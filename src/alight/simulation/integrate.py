"""The fixed-step integrator of a sample interval."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


def rk4_step(rates: Callable[[Any], Any], x: Any, dt: Any) -> Any:
    """One step of the classical Runge-Kutta method, order 4 where ``rates`` is smooth."""
    a = rates(x)
    b = rates(x + dt / 2 * a)
    c = rates(x + dt / 2 * b)
    d = rates(x + dt * c)
    return x + dt / 6 * (a + 2 * b + 2 * c + d)
