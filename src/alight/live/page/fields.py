"""What can be set on the page, read off the annotated parameter sets: unit, meaning, bounds."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, get_args, get_origin, get_type_hints

import annotated_types as at
import numpy as np

from alight.simulation.closed_loop import ClosedLoop
from alight.symbolic.parameters import Quantity, numeric_fields


@dataclass(frozen=True)
class Bounds:
    """Range of a number; an end that is excluded says so."""

    lower: float | None = None
    upper: float | None = None
    above: bool = False
    """Whether ``lower`` itself is excluded."""
    below: bool = False
    """Whether ``upper`` itself is excluded."""

    @property
    def told(self) -> str:
        """The range in symbols; empty without one."""
        left = "" if self.lower is None else f"{'>' if self.above else '≥'} {self.lower:g}"
        right = "" if self.upper is None else f"{'<' if self.below else '≤'} {self.upper:g}"
        return ", ".join(end for end in (left, right) if end)

    def problem(self, value: float) -> str:
        """What is wrong with a value; empty if nothing is."""
        low = self.lower is not None and (value <= self.lower if self.above else value < self.lower)
        high = self.upper is not None and (
            value >= self.upper if self.below else value > self.upper
        )
        return f"must be {self.told}" if low or high or not np.isfinite(value) else ""


@dataclass(frozen=True)
class Field:
    """One number: an entry of a parameter of the closed loop."""

    path: str
    """Path of the parameter, ``law.gains.k3``."""
    entry: int | None
    """Number of the entry of a vector, from 0; None for a number."""
    quantity: Quantity
    bounds: Bounds

    @property
    def key(self) -> str:
        """What tells it from all others."""
        return self.path if self.entry is None else f"{self.path}.{self.entry}"

    @property
    def symbol(self) -> str:
        """Its name in the paper's symbols, without the index."""
        return self.path.rpartition(".")[2]

    @property
    def meaning(self) -> str:
        """Meaning, unit and range in one sentence."""
        unit = f" [{self.quantity.unit}]" if self.quantity.unit else ""
        told = f"; {self.bounds.told}" if self.bounds.told else ""
        entry = "" if self.entry is None else f", entry {self.entry + 1}"
        return f"{self.symbol}{entry}: {self.quantity.meaning}{unit}{told}"

    def of(self, loop: ClosedLoop) -> float:
        """Its value in a closed loop."""
        value = value_at(loop, self.path)
        return float(value if self.entry is None else value[self.entry])


def value_at(loop: ClosedLoop, path: str) -> Any:
    """Value of a parameter: a number, or a tuple of them."""
    value: Any = loop
    for name in path.split("."):
        value = getattr(value, name)
    return value


def fields_of(loop: ClosedLoop, *paths: str) -> tuple[Field, ...]:
    """The fields of parameters or of whole parameter sets, in their order; absent ones left out."""
    found = []
    for path, value, quantity in numeric_fields(loop.law, "law."):
        if any(path == wanted or path.startswith(f"{wanted}.") for wanted in paths):
            owner = value_at(loop, path.rpartition(".")[0])
            bounds = bounds_of(type(owner), path.rpartition(".")[2], np.size(value))
            entries: Sequence[int | None] = range(len(bounds)) if np.ndim(value) else [None]
            found += [Field(path, i, quantity, bounds[i or 0]) for i in entries]
    return tuple(found)


def bounds_of(cls: type, name: str, size: int) -> tuple[Bounds, ...]:
    """Bounds of each entry of a field, from its annotation."""
    hint = get_type_hints(cls, include_extras=True)[name]
    found = list(_entries(hint, size))
    return tuple(found) if len(found) == size else (Bounds(),) * size


def _entries(hint: Any, size: int) -> Iterator[Bounds]:
    kind, args = get_origin(hint), get_args(hint)
    if kind is Annotated:
        own = _interval(args[1:])
        yield from [own] * size if own.told else _entries(args[0], size)
    elif kind is tuple:
        parts = args[:1] * size if args[-1] is Ellipsis else args
        for part in parts:
            yield from _entries(part, 1)
    else:
        yield Bounds()


def _interval(extras: Sequence[Any]) -> Bounds:
    made: dict[str, Any] = {}
    for extra in extras:
        if isinstance(extra, at.Gt):
            made |= {"lower": extra.gt, "above": True}
        elif isinstance(extra, at.Ge):
            made |= {"lower": extra.ge}
        elif isinstance(extra, at.Lt):
            made |= {"upper": extra.lt, "below": True}
        elif isinstance(extra, at.Le):
            made |= {"upper": extra.le}
    return Bounds(**made)
