"""From expressions of the coordinates to their values at many tries, with their rounding."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import casadi as ca
import numpy as np

from alight.symbolic.build import build
from alight.theory.falsification.rounding import with_rounding
from alight.theory.falsification.space import Columns, Space

Expressions = Mapping[str, Any]
"""Expressions by name."""


class Evaluated:
    """Named expressions of the coordinates of a space, built once.

    Parameters
    ----------
    space : Space
    expressions : callable
        From the symbols of the coordinates, by name, to scalar expressions, by name.
    """

    def __init__(self, space: Space, expressions: Callable[[Expressions], Expressions]) -> None:
        symbols = {name: ca.SX.sym(name) for name in space.ranges}
        outputs = expressions(symbols)
        self.coordinates, self.names = tuple(symbols), tuple(outputs)
        column = ca.vertcat(*symbols.values())
        self.graph = build("claim", {"coordinates": column}, dict(outputs))
        self._function = with_rounding(self.graph)

    def __call__(self, columns: Columns) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
        """Values at many tries, and how far rounding can have moved each of them."""
        found = self._function(np.array([columns[name] for name in self.coordinates]))
        rows = [np.asarray(row)[0] for row in found]
        half = len(self.names)
        values, errors = (dict(zip(self.names, r, strict=True)) for r in (rows[:half], rows[half:]))
        return values, errors


class Judged:
    """Violation of ``excess <= 0``: excess over size, less the rounding of the excess."""

    def __init__(self, space: Space, expressions: Callable[[Expressions], tuple[Any, Any]]) -> None:
        def named(c: Expressions) -> Expressions:
            return dict(zip(("excess", "size"), expressions(c), strict=True))

        self.evaluated = Evaluated(space, named)

    def __call__(self, columns: Columns) -> np.ndarray:
        """Violation at many tries."""
        values, errors = self.evaluated(columns)
        return (values["excess"] - errors["excess"]) / values["size"]
