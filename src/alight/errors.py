"""The errors of Alight: one root, which is also a ``ValueError``."""

from __future__ import annotations

from collections.abc import Iterable


class AlightError(ValueError):
    """Something that the caller can mend: what was wrong, where, and what would be right."""


class UnknownName(AlightError):
    """A name that is not among the allowed ones."""

    def __init__(self, what: str, name: object, allowed: Iterable[str]) -> None:
        self.name = name
        self.allowed = sorted(allowed)
        super().__init__(f"unknown {what} {name!r}; one of: {', '.join(self.allowed)}")


class InvalidParameters(AlightError):
    """Parameter values that are refused: ``problems`` holds one line for each."""

    def __init__(self, where: str, problems: list[str]) -> None:
        self.where = where
        self.problems = problems
        super().__init__("\n".join([where, *(f"  {problem}" for problem in problems)]))


class ExpressionError(AlightError):
    """An expression graph that would give wrong numbers silently."""


class Unreachable(AlightError):
    """A tip position that the arm cannot reach, or only in a singular pose."""
