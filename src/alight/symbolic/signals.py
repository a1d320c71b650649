"""Named signals with units, and the layout of a state or a recording as one column."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, get_args, get_type_hints

import casadi as ca
import numpy as np

from alight.errors import ExpressionError
from alight.symbolic.ops import concatenate, is_symbolic


@dataclass(frozen=True)
class Signal:
    """A named quantity that changes in time: unit, size, one sentence."""

    unit: str
    meaning: str
    size: int = 1


@dataclass(frozen=True)
class Layout:
    """Where each signal stands in one column."""

    signals: Mapping[str, Signal]

    @classmethod
    def of(cls, structure: type) -> Layout:
        """Read the layout off a ``NamedTuple`` whose fields are annotated with `Signal`."""
        hints = get_type_hints(structure, include_extras=True)
        return cls({n: get_args(h)[1] for n, h in hints.items() if len(get_args(h)) > 1})

    @property
    def size(self) -> int:
        """Number of scalars in the column."""
        return sum(s.size for s in self.signals.values())

    @property
    def columns(self) -> tuple[str, ...]:
        """Name of each scalar; entries of a vector carry an index from 1 (``e_r1``, ``e_r2``)."""
        return tuple(
            name if s.size == 1 else f"{name}{i + 1}"
            for name, s in self.signals.items()
            for i in range(s.size)
        )

    @property
    def units(self) -> tuple[str, ...]:
        """Unit of each scalar."""
        return tuple(s.unit for s in self.signals.values() for _ in range(s.size))

    def slices(self) -> dict[str, slice]:
        """The rows of each signal."""
        found, start = {}, 0
        for name, s in self.signals.items():
            found[name] = slice(start, start + s.size)
            start += s.size
        return found

    def unpack(self, column: Any) -> dict[str, Any]:
        """Values by name: scalars for signals of size one, vectors otherwise."""
        symbolic = is_symbolic(column)
        column = column if symbolic else np.asarray(column, dtype=float)
        return {
            name: column[rows] if symbolic or self.signals[name].size > 1 else column[rows][0]
            for name, rows in self.slices().items()
        }

    def pack(self, values: Mapping[str, Any]) -> Any:
        """One column from values by name.

        Raises
        ------
        ExpressionError
            If a value is missing, superfluous or of the wrong size.
        """
        if set(values) != set(self.signals):
            raise ExpressionError(
                f"signals {sorted(values)} given where {sorted(self.signals)} are laid out"
            )
        for name, signal in self.signals.items():
            value = values[name]
            size = value.numel() if isinstance(value, ca.SX) else np.size(value)
            if size != signal.size:
                raise ExpressionError(f"signal {name!r} has {size} entries, not {signal.size}")
        return concatenate(*(values[name] for name in self.signals))
