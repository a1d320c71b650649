"""The classical method of Runge and Kutta: what a located step is compared with."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any


def classical_step(rates: Callable[[Any], Any], x: Any, dt: Any) -> Any:
    """One step of order 4, whatever happens within it."""
    k1 = rates(x)
    k2 = rates(x + dt / 2 * k1)
    k3 = rates(x + dt / 2 * k2)
    k4 = rates(x + dt * k3)
    return x + dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
