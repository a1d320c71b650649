"""What a certificate is made of: conditions with both sides, and the constants in them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Relation = Literal[">", ">=", "<", "<="]


@dataclass(frozen=True)
class Constant:
    """A number that conditions are made of, or why it has no value."""

    symbol: str
    number: str
    """Where it stands in the paper, or the name of the proposition."""
    value: float | None
    unit: str
    meaning: str
    """One sentence."""
    undefined: str = ""
    """Why there is no value; empty if there is one."""


@dataclass(frozen=True)
class Condition:
    """An inequality at the numbers of a design: both sides, margin, and whether it holds."""

    number: str
    """Equation of the paper, ``"(38)"``, or name of our own, ``"VTX"``."""
    statement: str
    """The inequality in symbols."""
    left: float | None
    relation: Relation
    right: float | None
    unit: str
    """Unit of both sides; that of the left one where the paper compares different units."""
    meaning: str
    """One sentence: what it is for."""
    undefined: str = ""
    """Why a side has no value; empty if both have one."""
    fails: bool = False
    """Whether it is known to fail although a side has no value."""

    @property
    def margin(self) -> float | None:
        """Distance from the border, positive inside; None where a side has no value."""
        if self.left is None or self.right is None:
            return None
        return self.left - self.right if self.relation[0] == ">" else self.right - self.left

    @property
    def holds(self) -> bool | None:
        """Whether it holds; None where that is undefined."""
        if self.fails:
            return False
        if self.margin is None:
            return None
        return self.margin >= 0 if self.relation.endswith("=") else self.margin > 0
