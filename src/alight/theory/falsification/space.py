"""Where a search looks: named numbers over many decades, up to the borders of their domain."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

Range = Callable[[np.ndarray], np.ndarray]
"""From shares between 0 and 1 to values of one coordinate."""
Columns = Mapping[str, np.ndarray]
"""Values of each coordinate, one for each try."""


def log(low: float, high: float) -> Range:
    """Positive values, each decade alike."""
    ends = np.log(low), np.log(high)
    return lambda share: np.exp(ends[0] + share * (ends[1] - ends[0]))


def linear(low: float, high: float) -> Range:
    """Values between two ends."""
    return lambda share: low + share * (high - low)


def constant(value: float) -> Range:
    """One value alone."""
    return lambda share: np.full_like(share, value)


def both(low: float, high: float) -> Range:
    """Values of either sign, their magnitudes over decades, and zero between the signs."""
    size = log(low, high)

    def value(share: np.ndarray) -> np.ndarray:
        half = np.clip(2.02 * np.abs(share - 0.5) - 0.01, 0.0, 1.0)
        return np.sign(share - 0.5) * np.where(half > 0, size(half), 0.0)

    return value


def inside(least: float = 1e-9) -> Range:
    """Values in (-1, 1), as near to the ends as ``least``."""
    near = log(least, 1.0)
    return lambda share: np.sign(0.5 - share) * (near(1 - np.abs(2 * share - 1)) - 1)


@dataclass(frozen=True)
class Space:
    """The coordinates of a search, by name."""

    ranges: Mapping[str, Range]

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return len(self.ranges)

    def columns(self, shares: np.ndarray) -> dict[str, np.ndarray]:
        """Values of each coordinate from shares of shape (size, tries)."""
        return {
            name: made(row) for (name, made), row in zip(self.ranges.items(), shares, strict=True)
        }
