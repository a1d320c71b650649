"""Parameter sets: frozen dataclasses whose fields state unit, meaning and bound once."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Container, Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import (
    Annotated,
    Any,
    TypeVar,
    dataclass_transform,
    get_args,
    get_origin,
    get_type_hints,
)

import annotated_types as at
import casadi as ca
import numpy as np
import pydantic
import pydantic.dataclasses as pydantic_dataclasses

from alight.errors import InvalidParameters

T = TypeVar("T")

_CONFIG = pydantic.ConfigDict(extra="forbid", allow_inf_nan=False, arbitrary_types_allowed=True)


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
            names = [field.name for field in dataclasses.fields(made) if not field.kw_only]
            given = {**dict(zip(names, args, strict=False)), **kwargs}
            raise InvalidParameters(cls.__name__, problems_of(error, given, names)) from None

    made.__init__ = init  # type: ignore[method-assign]
    return made  # type: ignore[return-value]


def problems_of(
    error: pydantic.ValidationError, given: Any = None, positional: Sequence[str] = ()
) -> list[str]:
    """One line for each refused value: path, value, reason.

    With the data that was ``given`` the paths hold nothing but its keys: the members of a union,
    which pydantic inserts, are left out. ``positional`` names the arguments without a keyword.
    """
    lines = []
    for item in error.errors():
        loc = item["loc"]
        if positional and loc and isinstance(loc[0], int) and loc[0] < len(positional):
            loc = (positional[loc[0]], *loc[1:])
        parts = loc if given is None else _keys(loc, given, item["type"])
        if parts is not None:
            lines.append(_problem(".".join(str(part) for part in parts), dict(item)))
    return list(dict.fromkeys(lines)) or problems_of(error, positional=positional)


_IN_TOML = {
    "tuple_type": "Input should be a list of values",
    **dict.fromkeys(
        ("dataclass_type", "dict_type", "model_attributes_type"), "Input should be a table"
    ),
}
"""What is right where Python's words would not help the author of a file."""


def _keys(loc: tuple[int | str, ...], given: Any, kind: str) -> list[int | str] | None:
    """The keys of a path; None if it leads through the member of a union that was not meant."""
    keys: list[int | str] = []
    for part in loc:
        is_list = isinstance(given, (list, tuple))
        here = part in given if isinstance(given, Mapping) else is_list and isinstance(part, int)
        if here:
            keys.append(part)
            given = given[part] if not is_list or int(part) < len(given) else None
        elif kind in ("missing", "missing_argument") and part == loc[-1]:
            keys.append(part)
        elif isinstance(part, str) and part.startswith(("tuple[", "list[")) != is_list:
            return None
    return keys


def _problem(path: str, item: Mapping[str, Any]) -> str:
    """What was refused at a path, and what would be right."""
    kind, value, context = item["type"], item["input"], item.get("ctx", {})
    message = _IN_TOML.get(kind, item["msg"].removeprefix("Value error, "))
    if kind in ("extra_forbidden", "unexpected_keyword_argument"):
        return f"{path}: unknown name; remove it or correct its spelling"
    if kind in ("missing", "missing_argument"):
        return f"{path}: missing; give it a value"
    if kind == "union_tag_not_found":
        return f"{path}.{_tag(context)}: missing; give it a value"
    if kind == "union_tag_invalid":
        allowed = context["expected_tags"]
        return f"{path}.{_tag(context)} = {context['tag']!r}: Input should be one of {allowed}"
    if not path:
        return message
    # Of a whole table the message says which of its values is meant.
    shown = "" if isinstance(value, Mapping) else f" = {_short(value)}"
    return f"{path}{shown}: {message}"


def _tag(context: Mapping[str, Any]) -> str:
    """Key of a tagged union that says which of its members is meant."""
    return str(context["discriminator"]).strip("'")


def _short(value: Any, most: int = 200) -> str:
    text = repr(value)
    return text if len(text) <= most else f"{text[:most]}..."


def rebind(obj: T, **values: Any) -> T:
    """A copy with some fields replaced and nothing validated: fields may hold expressions."""
    made = object.__new__(type(obj))
    made.__dict__.update(obj.__dict__)
    made.__dict__.update(values)
    return made


def is_parameters(obj: Any) -> bool:
    """Whether an object is a parameter set."""
    return dataclasses.is_dataclass(obj) and not isinstance(obj, type)


def replaced(obj: Any, values: Mapping[str, Any]) -> Any:
    """A copy with some values, given by path such as ``law.gains.k1``, replaced and validated.

    Raises
    ------
    InvalidParameters
        If a value is refused: its shape, a bound, or what the values must fulfil together.
    """
    direct = {path: value for path, value in values.items() if "." not in path}
    for name in {path.split(".")[0] for path in values if "." in path}:
        own = {p.split(".", 1)[1]: v for p, v in values.items() if p.startswith(f"{name}.")}
        direct[name] = replaced(getattr(obj, name), own)
    return dataclasses.replace(obj, **direct)


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
    known = quantities(type(obj))  # type: ignore[arg-type]
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


def lift(obj: Any, prefix: str = "", but: Container[str] = ()) -> Lifted:
    """Replace the numbers of a parameter set by symbols, so that they become inputs.

    Those whose path stands in ``but`` stay numbers.
    """
    symbols: list[ca.SX] = []
    paths: list[str] = []

    def lifted(node: Any, at_path: str) -> Any:
        replaced = {}
        for field in dataclasses.fields(node):
            value = getattr(node, field.name)
            path = f"{at_path}{field.name}"
            if is_parameters(value):
                replaced[field.name] = lifted(value, f"{path}.")
            elif _numeric(value) and not isinstance(value, int) and path not in but:
                size = len(value) if isinstance(value, tuple) else 1
                symbol = ca.SX.sym(path, size)
                replaced[field.name] = symbol
                symbols.append(symbol)
                paths.extend([path] if size == 1 else [f"{path}{i + 1}" for i in range(size)])
        return rebind(node, **replaced)

    made = lifted(obj, prefix)
    return Lifted(made, ca.vertcat(*symbols), tuple(paths))


def values_of(obj: Any, prefix: str = "", but: Container[str] = ()) -> np.ndarray:
    """The numbers of a parameter set in the order of `lift`, without those in ``but``."""
    fields = numeric_fields(obj, prefix)
    parts = [np.atleast_1d(np.asarray(v, dtype=float)) for path, v, _ in fields if path not in but]
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


def structure_of(obj: Any) -> Hashable:
    """What shapes the graph of a parameter set: its classes and everything that is no number."""
    if not is_parameters(obj):
        if _numeric(obj) and not isinstance(obj, int):
            return ("numbers", len(obj) if isinstance(obj, tuple) else 1)
        if isinstance(obj, np.ndarray):
            return (obj.shape, obj.dtype.str, obj.tobytes())
        return (type(obj), obj) if isinstance(obj, Hashable) else repr(obj)
    fields = tuple((f.name, structure_of(getattr(obj, f.name))) for f in dataclasses.fields(obj))
    return (type(obj), fields)
