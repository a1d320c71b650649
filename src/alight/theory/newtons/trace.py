"""A quantity along a run beside its proven bounds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Trace:
    """A quantity and its bounds at the instants at which they are stated."""

    t: np.ndarray
    """Times [s], shape (n,): of the whole run, or of the part that the bound speaks of."""
    value: np.ndarray
    """The quantity, shape (n,)."""
    lower: np.ndarray | None
    """What it never falls below, shape (n,); None if nothing is stated."""
    upper: np.ndarray | None
    """What it never exceeds, shape (n,)."""
    unit: str
    source: str
    """The proposition or equation, and what the bound is made of."""

    @property
    def excess(self) -> float:
        """By how much the value leaves its bounds at worst; negative inside, 0 for no sample."""
        over = [] if self.upper is None else [self.value - self.upper]
        under = [] if self.lower is None else [self.lower - self.value]
        return max((float(part.max()) for part in over + under if part.size), default=0.0)


def within(
    t: np.ndarray, value: np.ndarray, most: np.ndarray | float, unit: str, source: str
) -> Trace:
    """``|value| <= most``."""
    bound = np.broadcast_to(most, value.shape)
    return Trace(t, value, -bound, bound, unit, source)


def below(
    t: np.ndarray, value: np.ndarray, most: np.ndarray | float, unit: str, source: str
) -> Trace:
    """``value <= most``."""
    return Trace(t, value, None, np.broadcast_to(most, value.shape), unit, source)
