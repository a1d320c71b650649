"""``alight scenarios``: what ships with Alight, and every value of a scenario with its source."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer
from rich.text import Text

from alight.cli.options import AsJson
from alight.cli.output import show, show_json, table

if TYPE_CHECKING:
    from alight.scenarios import Scenario

LISTED_APART = ("title", "description", "law")
"""Fields of a document that are no values of it."""
FROM_SCENARIO = ("model", "target")
"""Fields of a law that repeat what the scenario states elsewhere."""


class Value(NamedTuple):
    """One value of a scenario."""

    path: str
    value: Any
    unit: str
    meaning: str
    kind: str
    """published, assumed, or default where the file is silent."""
    note: str


def scenarios(
    name: Annotated[
        str | None,
        typer.Argument(
            metavar="SCENARIO",
            help="A shipped scenario, or the path of a TOML file: shows all of its values.",
            show_default=False,
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """List the scenarios that ship, or every value of one with its unit and its source.

    Each value is published (with the equation or section that prints it), assumed (with the
    reason), or a default of Alight where the scenario does not state it.
    """
    if name is None:
        _list(as_json)
    else:
        _describe(name, as_json)


def _list(as_json: bool) -> None:
    from alight.scenarios import load_scenario, shipped_scenarios

    found = {name: load_scenario(name) for name in shipped_scenarios()}
    if as_json:
        show_json({name: scenario.title for name, scenario in found.items()})
        return
    rows = table("scenario", "title")
    for name, scenario in found.items():
        rows.add_row(name, scenario.title)
    show(rows)


def _describe(name: str, as_json: bool) -> None:
    from alight.scenarios import load_scenario

    scenario = load_scenario(name)
    values = list(values_of(scenario))
    if as_json:
        show_json({v.path: {k: x for k, x in v._asdict().items() if k != "path"} for v in values})
        return
    rows = table("path", "value", "unit", "meaning", "source")
    group = None
    for v in values:
        head = v.path.rpartition(".")[0].partition(".")[0]
        if group not in (None, head):
            rows.add_section()
        group = head
        source = f"{v.kind}: {v.note}" if v.note else v.kind
        style = "dim" if v.kind == "default" else None
        rows.add_row(v.path, _text(v.value), v.unit, v.meaning, source, style=style)
    show(Text(scenario.title, style="bold"), scenario.document.description, rows)


def values_of(scenario: Scenario) -> Iterator[Value]:
    """Every value of a scenario, in the order of its file; those of the law last."""
    from alight.symbolic.parameters import is_parameters

    plain = {f.name for f in dataclasses.fields(scenario.document)} - set(LISTED_APART)
    yield from _values(scenario, scenario.document, "", plain)
    yield _value(scenario, "law.type", scenario.document.law["type"], None)
    law: Any = scenario.law
    if is_parameters(law):
        own = {f.name for f in dataclasses.fields(law)} - set(FROM_SCENARIO)
        yield from _values(scenario, law, "law.", own)
    else:
        for key, value in scenario.document.law.items():
            if key != "type":
                yield _value(scenario, f"law.{key}", value, None)


def _values(
    scenario: Scenario, obj: Any, prefix: str, names: set[str] | None = None
) -> Iterator[Value]:
    from alight.symbolic.parameters import is_parameters, quantities

    cls: type = type(obj)
    known = quantities(cls)
    for field in dataclasses.fields(obj):
        if names is not None and field.name not in names:
            continue
        value, path = getattr(obj, field.name), f"{prefix}{field.name}"
        if is_parameters(value):
            yield from _values(scenario, value, f"{path}.")
        elif isinstance(value, Mapping):
            for key, part in value.items():
                yield from _values(scenario, part, f"{path}.{key}.")
        else:
            yield _value(scenario, path, value, known.get(field.name))


def _value(scenario: Scenario, path: str, value: Any, quantity: Any) -> Value:
    unit, meaning = (quantity.unit, quantity.meaning) if quantity else ("", "")
    source = scenario.provenance.get(path)
    if source:
        return Value(path, value, unit, meaning, source.kind, source.note)
    return Value(path, value, unit, meaning, "stated" if _stated(scenario, path) else "default", "")


def _stated(scenario: Scenario, path: str) -> bool:
    at: Any = scenario.data
    for part in path.split("."):
        if part not in at:
            return False
        at = at[part]
    return True


def _text(value: Any) -> str:
    if isinstance(value, tuple):
        return f"[{', '.join(_text(entry) for entry in value)}]"
    if isinstance(value, bool) or value is None:
        return "none" if value is None else str(value).lower()
    return f"{value:.6g}" if isinstance(value, float) else str(value)
