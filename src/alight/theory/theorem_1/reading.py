"""The outcome: constants and conditions, once as printed and once as corrected."""

from __future__ import annotations

from dataclasses import dataclass

from alight.theory.condition import Condition, Constant


@dataclass(frozen=True)
class Reading:
    """Theorem 1 at the numbers of a design, in one reading."""

    constants: tuple[Constant, ...]
    conditions: tuple[Condition, ...]
    joint: tuple[Condition, ...]
    """What (26), (37), (38) and (70) imply together: necessary, whatever the gains."""

    @property
    def holds(self) -> bool | None:
        """Whether every condition holds; None where none fails and some are undefined."""
        verdicts = {condition.holds for condition in self.conditions}
        return False if False in verdicts else None if None in verdicts else True

    def condition(self, number: str) -> Condition:
        """The condition of a number, ``"(26)"``; `KeyError` if there is none."""
        return {made.number: made for made in self.conditions}[number]

    def constant(self, symbol: str) -> Constant:
        """The constant of a symbol, ``"zeta_1"``; `KeyError` if there is none."""
        return {made.symbol: made for made in self.constants}[symbol]


@dataclass(frozen=True)
class Theorem1:
    """Theorem 1 in both readings."""

    printed: Reading
    """As the paper prints it."""
    corrected: Reading
    """With the errata mended."""
