"""Reading a scenario: file, inheritance, sources, overrides, validation."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pydantic

from alight.errors import AlightError, InvalidParameters, UnknownName, Unreachable
from alight.scenarios.laws import make_law
from alight.scenarios.scenario import Document, Provenance, Scenario
from alight.scenarios.shipped import shipped_file, shipped_scenarios
from alight.simulation.closed_loop import InitialState
from alight.symbolic.parameters import problems_of

SOURCES = ("published", "assumed")
UNCHECKED = ("extends", "provenance")
"""Tables that describe a file and are not part of what is simulated."""


class ScenarioError(AlightError):
    """A scenario that cannot be used: file, field, value, and what would be right."""

    def __init__(self, file: str, problems: Sequence[str]) -> None:
        self.file = file
        self.problems = list(problems)
        super().__init__("\n".join([f"{file}:", *(f"  {line}" for line in self.problems)]))


def load_scenario(
    name: str | Path, overrides: Mapping[str, Any] | Sequence[str] = ()
) -> Scenario:
    """Load a shipped scenario by name, or a scenario file by path.

    Parameters
    ----------
    name : str or Path
        ``"experiment-1"``, or the path of a TOML file.
    overrides : mapping, or sequence of ``"path=value"``
        Values that replace those of the file, by path: ``{"plant.body.m": 2.0}``.

    Raises
    ------
    ScenarioError
        If the file cannot be read, or anything in it is refused.
    UnknownName
        If it is neither a shipped scenario nor a file.
    """
    label, raw = _read(name)
    values, sources = split_sources(raw)
    if not isinstance(overrides, Mapping):
        overrides = parse_overrides(overrides)
    for path, value in overrides.items():
        _set(values, path, value, label)
        sources[path] = Provenance("assumed", "set by the user")
    return from_data(values, label, sources)


def from_data(
    values: Mapping[str, Any], label: str, sources: Mapping[str, Provenance] | None = None
) -> Scenario:
    """Validate plain data as a scenario; ``label`` stands in error messages."""
    content = {key: value for key, value in values.items() if key not in UNCHECKED}
    try:
        document = pydantic.TypeAdapter(Document).validate_python(content)
    except pydantic.ValidationError as error:
        raise ScenarioError(label, problems_of(error)) from None
    try:
        law = make_law(document.law, document.plant, document.target)
    except InvalidParameters as error:
        raise ScenarioError(label, [f"law.{line}" for line in error.problems]) from None
    except (UnknownName, TypeError) as error:
        raise ScenarioError(label, [f"law: {error}"]) from None
    return Scenario(
        name=Path(label).stem,
        document=document,
        law=law,
        start=_pose(document, label),
        provenance=dict(sources or {}),
        data=content,
    )


def _pose(document: Document, label: str) -> InitialState:
    arm, start, target = document.plant.arm, document.start, document.target
    try:
        q = arm.inverse(start.x_r, start.elbow)
    except Unreachable as error:
        raise ScenarioError(label, [f"start.x_r = {list(start.x_r)}: {error}"]) from None
    try:
        arm.inverse((target.x_md, target.x_rd2), start.elbow)
    except Unreachable as error:
        point = [target.x_md, target.x_rd2]
        raise ScenarioError(label, [f"target.x_md, target.x_rd2 = {point}: {error}"]) from None
    return InitialState(q=(float(q[0]), float(q[1])), x_m=start.x_m)


def _read(name: str | Path, seen: tuple[str, ...] = ()) -> tuple[str, dict[str, Any]]:
    """Content of a scenario and of all that it extends."""
    label = str(name)
    if label in seen:
        raise ScenarioError(label, [f"extends itself: {' -> '.join((*seen, label))}"])
    if label in shipped_scenarios():
        text = shipped_file(label).read_text("utf-8")
    elif isinstance(name, Path) or label.endswith(".toml") or Path(label).exists():
        try:
            text = Path(label).read_text("utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise ScenarioError(label, [f"cannot be read: {error}"]) from None
    else:
        raise UnknownName("scenario", label, (*shipped_scenarios(), "a path to a .toml file"))
    try:
        content = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ScenarioError(label, [f"is not valid TOML: {error}"]) from None
    if "extends" not in content:
        return label, content
    parent = content.pop("extends")
    beside = Path(label).parent / str(parent)
    _, base = _read(beside if beside.is_file() else str(parent), (*seen, label))
    return label, merge(base, content)


def merge(base: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    """Tables merged key by key; what ``over`` states replaces what ``base`` has."""
    merged = dict(base)
    for key, value in over.items():
        both = isinstance(value, Mapping) and isinstance(merged.get(key), Mapping)
        replaced_type = both and "type" in value and value["type"] != merged[key].get("type")
        keeps = both and not _is_sourced(value) and (key == "law" or not replaced_type)
        merged[key] = merge(merged[key], value) if keeps else value
    return merged


def _is_sourced(value: Any) -> bool:
    return isinstance(value, Mapping) and "value" in value


def split_sources(
    table: Mapping[str, Any], prefix: str = ""
) -> tuple[dict[str, Any], dict[str, Provenance]]:
    """Separate ``{ value = 2.0, published = "(42)" }`` into the value and its source."""
    values: dict[str, Any] = {}
    sources: dict[str, Provenance] = {}
    for key, item in table.items():
        path = f"{prefix}{key}"
        if _is_sourced(item):
            values[key] = item["value"]
            for kind in SOURCES:
                if kind in item:
                    sources[path] = Provenance(kind, str(item[kind]))  # type: ignore[arg-type]
        elif isinstance(item, Mapping):
            values[key], nested = split_sources(item, f"{path}.")
            sources.update(nested)
        else:
            values[key] = item
    return values, sources


def parse_overrides(settings: Sequence[str]) -> dict[str, Any]:
    """Turn ``["plant.body.m=2", "law.type=unsaturated"]`` into values by path.

    Raises
    ------
    AlightError
        If an entry is not of the form ``path=value``.
    """
    found = {}
    for setting in settings:
        path, equals, text = setting.partition("=")
        if not equals or not path.strip() or not text.strip():
            raise AlightError(f"--set {setting!r}: must read path=value, as in plant.body.m=2.0")
        try:
            found[path.strip()] = tomllib.loads(f"value = {text}")["value"]
        except tomllib.TOMLDecodeError:
            found[path.strip()] = text.strip()
    return found


def _set(values: dict[str, Any], path: str, value: Any, label: str) -> None:
    *tables, key = path.split(".")
    at = values
    for name in tables:
        at = at.setdefault(name, {})
        if not isinstance(at, dict):
            raise ScenarioError(label, [f"{path}: {name} is a value and not a table"])
    at[key] = value
