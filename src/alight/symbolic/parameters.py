"""Parameter sets: frozen dataclasses whose fields state unit, meaning and bound once."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Annotated, Any, TypeVar, dataclass_transform, get_args, get_origin, get_type_hints

import annotated_types as at
import casadi as ca
import numpy as np
import pydantic
import pydantic.dataclasses as pydantic_dataclasses

from alight.errors import InvalidParameters

T = TypeVar("T")

_CONFIG = pydantic.ConfigDict(
    extra="forbid", allow_inf_nan=False, arbitrary_types_allowed=True
)


@dataclass(frozen=True)
class Quantity:
    """What a number means: its unit, a sentence about it."""

    unit: str
    meaning: str


Positive = Annotated[float, at.Gt(0)]
NonNegative = Annotated[float, at.Ge(0)]
Pair = tuple[float, float]
PositivePair = tuple[Positive, Positive]
NonNegativePair = tuple[NonNegative, NonNegative]


@dataclass_transform(frozen_default=True, field_specifiers=(dataclasses.field,))
def parameters(cls: type[T]) -> type[T]:
    """Make a class a frozen, validated parameter set.

    Unknown keys, wrong shapes, values out of bounds, NaN and infinity raise
    `InvalidParameters` when an instance is made.
    """
    made = pydantic_dataclasses.dataclass(frozen=True, config=_CONFIG)(cls)
    validated: Callable[..., None] = made.__init__

    @functools.wraps(validated)
    def init(self: Any, *args: Any, **kwargs: Any) -> None:
        try:
            validated(self, *args, **kwargs)
        except pydantic.ValidationError as error:
            raise InvalidParameters(cls.__name__, problems_of(error)) from None

    made.__init__ = init  # type: ignore[misc]
    return made  # type: ignore[return-value]


def problems_of(error: pydantic.ValidationError) -> list[str]:
    """One line for each refused value: path, value, reason."""
    lines = []
    for item in error.errors():
        path = ".".join(str(part) for part in item["loc"])
        message = item["msg"].removeprefix("Value error, ")
        if item["type"] in ("extra_forbidden", "unexpected_keyword_argument"):
            lines.append(f"{path}: unknown name; remove it or correct its spelling")
        elif item["type"] in ("missing", "missing_argument"):
            lines.append(f"{path}: missing; give it a value")
        elif not path:
            lines.append(message)
        else:
            lines.append(f"{path} = {item['input']!r}: {message}")
    return lines


def rebind(obj: T, **values: Any) -> T:
    """A copy with some fields replaced and nothing validated: fields may hold expressions."""
    made = object.__new__(type(obj))
    made.__dict__.update(obj.__dict__)
    made.__dict__.update(values)
    return made


def is_parameters(obj: Any) -> bool:
    """Whether an object is a parameter set."""
    return dataclasses.is_dataclass(obj) and not isinstance(obj, type)


@functools.cache
def quantities(cls: type) -> dict[str, Quantity]:
    """Unit and meaning of each numeric field of a parameter class."""
    found = {}
    for name, hint in get_type_hints(cls, include_extras=True).items():
        if get_origin(hint) is Annotated:
            for extra in get_args(hint)[1:]:
                if isinstance(extra, Quantity):
                    found[name] = extra
    return found


def _numeric(value: Any) -> bool:
    if isinstance(value, tuple):
        return bool(value) and all(_numeric(v) for v in value)
    return isinstance(value, (float, int, np.floating)) and not isinstance(value, bool)


def numeric_fields(obj: Any, prefix: str = "") -> Iterator[tuple[str, Any, Quantity]]:
    """Path, value and quantity of every number in a parameter set, nested ones included.

    Integers (an order, a count) fix the shape of a graph and are passed over.
    """
    known = quantities(type(obj))
    for field in dataclasses.fields(obj):
        value = getattr(obj, field.name)
        path = f"{prefix}{field.name}"
        if is_parameters(value):
            yield from numeric_fields(value, f"{path}.")
        elif _numeric(value) and not isinstance(value, int):
            yield path, value, known.get(field.name, Quantity("", ""))


@dataclass(frozen=True)
class Lifted:
    """A parameter set whose numbers have become symbols."""

    obj: Any
    symbols: ca.SX
    """All of them, one column."""
    paths: tuple[str, ...]
    """Path of each entry of ``symbols``; entries of a vector carry an index from 1."""


def lift(obj: Any, prefix: str = "") -> Lifted:
    """Replace every number of a parameter set by a symbol, so that it becomes an input."""
    symbols: list[ca.SX] = []
    paths: list[str] = []

    def lifted(node: Any, at_path: str) -> Any:
        replaced = {}
        for field in dataclasses.fields(node):
            value = getattr(node, field.name)
            path = f"{at_path}{field.name}"
            if is_parameters(value):
                replaced[field.name] = lifted(value, f"{path}.")
            elif _numeric(value) and not isinstance(value, int):
                size = len(value) if isinstance(value, tuple) else 1
                symbol = ca.SX.sym(path, size)
                replaced[field.name] = symbol
                symbols.append(symbol)
                paths.extend([path] if size == 1 else [f"{path}{i + 1}" for i in range(size)])
        return rebind(node, **replaced)

    made = lifted(obj, prefix)
    return Lifted(made, ca.vertcat(*symbols), tuple(paths))


def values_of(obj: Any) -> np.ndarray:
    """The numbers of a parameter set in the order of `lift`."""
    parts = [np.atleast_1d(np.asarray(v, dtype=float)) for _, v, _ in numeric_fields(obj)]
    return np.concatenate(parts) if parts else np.zeros(0)


def symbols_of(obj: Any) -> list[ca.SX]:
    """Every symbol that stands in a (lifted) parameter set."""
    found: list[ca.SX] = []
    for field in dataclasses.fields(obj):
        value = getattr(obj, field.name)
        if is_parameters(value):
            found += symbols_of(value)
        elif isinstance(value, ca.SX):
            found += ca.symvar(value)
    return found

