"""Reading a scenario: file, inheritance, sources, overrides, validation."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeGuard

import pydantic

from alight.errors import AlightError, InvalidParameters, UnknownName, Unreachable
from alight.scenarios.laws import make_law, share_settings
from alight.scenarios.scenario import Document, Provenance, Scenario
from alight.scenarios.shipped import shipped_file, shipped_scenarios
from alight.simulation.closed_loop import InitialState
from alight.symbolic.parameters import problems_of

SOURCES = ("published", "assumed")
UNCHECKED = ("extends", "provenance")
"""Tables that describe a file and are not part of what is simulated."""
MOST_SAMPLES = 1e9
"""Longest run, in samples."""


class ScenarioError(AlightError):
    """A scenario that cannot be used: file, field, value, and what would be right."""

    def __init__(self, file: str, problems: Sequence[str]) -> None:
        self.file = file
        self.problems = list(problems)
        super().__init__("\n".join([f"{file}:", *(f"  {line}" for line in self.problems)]))


def load_scenario(name: str | Path, overrides: Mapping[str, Any] | Sequence[str] = ()) -> Scenario:
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
    if problems := list(_wrong_sources(raw)):
        raise ScenarioError(label, problems)
    values, sources = split_sources(raw)
    if not isinstance(overrides, Mapping):
        overrides = parse_overrides(overrides)
    # The type of the law first: with another one its other settings may go.
    for path in sorted(overrides, key=lambda path: path != "law.type"):
        replaced = _set(values, path, overrides[path], label)
        sources = {p: s for p, s in sources.items() if not f"{p}.".startswith(f"{replaced}.")}
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
        raise ScenarioError(label, problems_of(error, content)) from None
    _refuse_endless(document, label)
    try:
        law = make_law(document.law, document.plant, document.target)
    except InvalidParameters as error:
        raise ScenarioError(label, [f"law.{line}" for line in error.problems]) from None
    except AlightError as error:
        problem = f"law.type = {document.law.get('type')!r}: {error}"
        raise ScenarioError(label, [problem]) from None
    made = Scenario(
        name=Path(label).stem,
        document=document,
        law=law,
        start=_pose(document, label),
        provenance=dict(sources or {}),
        data=content,
    )
    _refuse_unknown_limits(made, label)
    return made


def _refuse_unknown_limits(scenario: Scenario, label: str) -> None:
    """Refuse a limit of what is no signal: it would never trip."""
    known = scenario.closed_loop.signals
    unknown = [name for name in scenario.document.limits if name not in known]
    if unknown:
        signals = ", ".join(sorted(known))
        raise ScenarioError(
            label, [f"limits.{n}: no such signal; one of: {signals}" for n in unknown]
        )


def _refuse_endless(document: Document, label: str) -> None:
    """Refuse a run that no memory can hold, before anything is computed."""
    rate = document.testbed.sample_rate
    if document.duration * rate > MOST_SAMPLES:
        problem = (
            f"duration = {document.duration:g}: needs {document.duration * rate:.3g} samples at "
            f"testbed.sample_rate = {rate:g}; must be at most {MOST_SAMPLES / rate:g} s"
        )
        raise ScenarioError(label, [problem])


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
    shipped = label in shipped_scenarios()
    content = _content(label, shipped)
    here = label if shipped else os.path.realpath(label)
    if here in seen:
        raise ScenarioError(label, [f"extends itself: {' -> '.join((*seen, here))}"])
    if "extends" not in content:
        return label, content
    _, base = _read(_parent(label, shipped, content.pop("extends")), (*seen, here))
    return label, merge(base, content)


def _parent(label: str, shipped: bool, parent: Any) -> str:
    """What a scenario extends: a file beside it, or a shipped scenario."""
    if not isinstance(parent, str):
        problem = f"extends = {parent!r}: must be the name of a scenario, or the path of one"
        raise ScenarioError(label, [problem])
    beside = os.path.join(os.path.dirname(label), parent)
    if not shipped and os.path.isfile(beside):
        return beside
    if shipped:  # so that a copy of a shipped file, beside a copy of its parent, stands by itself
        parent = parent.removesuffix(".toml")
    if parent not in shipped_scenarios():
        names = ", ".join(shipped_scenarios())
        problem = f"extends = {parent!r}: there is no file {beside}; scenarios that ship: {names}"
        raise ScenarioError(label, [problem])
    return parent


def _content(label: str, shipped: bool) -> dict[str, Any]:
    """What stands in one file."""
    if not (shipped or label.endswith(".toml") or os.path.exists(label)):
        raise UnknownName("scenario", label, (*shipped_scenarios(), "a path to a .toml file"))
    try:
        text = (shipped_file(label) if shipped else Path(label)).read_text("utf-8-sig")
        return tomllib.loads(text)
    except OSError as error:
        problem = f"cannot be read: {error.strerror or error}"
    except UnicodeDecodeError as error:
        problem = (
            f"byte {error.object[error.start]:#04x} at position {error.start} is not UTF-8; "
            "save the file in this encoding"
        )
    except ValueError as error:
        problem = f"is not valid TOML: {error}"
    raise ScenarioError(label, [problem])


def merge(base: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    """Tables merged key by key; what ``over`` states replaces what ``base`` has.

    A table of another type replaces the whole of the old one, but for a law on the same error
    system: it keeps the settings that it does not state.
    """
    merged = dict(base)
    for key, value in over.items():
        old = merged.get(key)
        merged[key] = value
        if _is_table(old) and _is_table(value):
            before = _plain(old.get("type"))
            after = _plain(value.get("type", before))
            if before == after or (key == "law" and share_settings(before, after)):
                merged[key] = merge(old, value)
    return merged


def _is_table(value: Any) -> TypeGuard[Mapping[str, Any]]:
    return isinstance(value, Mapping) and not _is_sourced(value)


def _plain(value: Any) -> Any:
    return value["value"] if _is_sourced(value) else value


def _is_sourced(value: Any) -> bool:
    return isinstance(value, Mapping) and "value" in value


def identification_of(name: str | Path) -> dict[str, Any]:
    """Record that `alight identify` left in a scenario; empty if it was not identified."""
    _, raw = _read(name)
    provenance = raw.get("provenance", {})
    return dict(provenance.get("identification", {}))


def _wrong_sources(table: Mapping[str, Any], prefix: str = "") -> Iterator[str]:
    """What is wrong with entries such as ``{ value = 2.0, published = "(42)" }``."""
    for key, item in table.items():
        path = f"{prefix}{key}"
        if _is_sourced(item):
            kinds = [kind for kind in item if kind != "value"]
            if not set(kinds) <= set(SOURCES) or len(kinds) > 1:
                yield (
                    f"{path}: {', '.join(kinds)} beside its value; "
                    "one of published or assumed may stand there"
                )
            elif not all(isinstance(item[kind], str) for kind in kinds):
                yield f"{path}.{kinds[0]} = {item[kinds[0]]!r}: must be a text"
        elif isinstance(item, Mapping) and path not in UNCHECKED:
            yield from _wrong_sources(item, f"{path}.")


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
        parts = path.strip().split(".")
        if not equals or not all(parts) or not text.strip():
            raise AlightError(f"--set {setting!r}: must read path=value, as in plant.body.m=2.0")
        try:
            found[path.strip()] = tomllib.loads(f"value = {text}")["value"]
        except tomllib.TOMLDecodeError:
            found[path.strip()] = text.strip()
    return found


def _set(values: dict[str, Any], path: str, value: Any, label: str) -> str:
    """Set a value by its path, and return the path of all that was replaced."""
    *tables, key = path.split(".")
    if path.split(".")[0] in UNCHECKED:
        raise ScenarioError(label, [f"{path}: describes the file and cannot be set"])
    at = values
    for name in tables:
        at = at.setdefault(name, {})
        if not isinstance(at, dict):
            raise ScenarioError(label, [f"{path}: {name} is a value and not a table"])
    if path == "law.type" and not share_settings(at.get(key), value):
        at.clear()
        path = "law"
    at[key] = value
    return path
