"""What a falsification search hands back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Attempt:
    """The best attempt of one search to break one claim."""

    proposition: str
    claim: str
    """What is claimed; a positive `best` would break it."""
    tries: int
    """How often the violation was evaluated."""
    best: float
    """Largest violation found, relative to the terms it is made of, less what rounding explains."""
    at: Mapping[str, float]
    """Where it was found: design and state, by name, in SI units."""
    method: str
    """How it was searched."""

    @property
    def broken(self) -> bool:
        """Whether the claim is wrong."""
        return self.best > 0
