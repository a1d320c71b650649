"""A draft kept as a scenario file, which every command accepts."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from datetime import datetime
from pathlib import Path
from typing import Any

import tomlkit

from alight.errors import AlightError
from alight.files import FileError, whole_file
from alight.live.bank import Bank
from alight.scenarios import Scenario, load_scenario
from alight.scenarios.load import merge
from alight.scenarios.shipped import shipped_scenarios
from alight.simulation.closed_loop import ClosedLoop
from alight.symbolic.parameters import numeric_fields

FILE_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9 ._-]{0,80}\.toml")


def save_scenario(
    folder: Path, name: str, bank: Bank, number: int, loop: ClosedLoop, *, replace: bool = False
) -> Path:
    """Write the scenario of a bench with the law of a draft.

    The file extends the scenario that ships where it can, and states what differs; otherwise it
    states everything.

    Parameters
    ----------
    folder : Path
        Where the file shall stand.
    name : str
        Its name, ending in ``.toml``, without folders.
    bank, number, loop
        The laws of the bench, the number of the one that the scenario shall have, and its loop.
    replace : bool
        Whether a file of that name may be replaced.

    Raises
    ------
    FileError
        If there is such a file already, or it cannot be written.
    AlightError
        If the name is none, or the file would not give the scenario back.
    """
    if not FILE_NAME.fullmatch(name):
        raise AlightError(
            f"{name!r} is no name for a scenario: letters, digits, '.', '_' and '-', "
            "ending in .toml"
        )
    path = folder / name
    if path.exists() and not replace:
        raise FileError(path, "is there already")
    text = tomlkit.dumps(document_of(bank, number, loop))
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError(folder, f"cannot be made: {error.strerror}") from error
    with whole_file(path) as file:
        file.write(text.encode())
    if load_scenario(path).law != loop.law:
        path.unlink()
        raise AlightError(f"{path} would not give the law of the draft back; it was removed")
    return path


def document_of(bank: Bank, number: int, loop: ClosedLoop) -> Any:
    """The file's content."""
    scenario = bank.scenario
    data = _data(bank, number, loop)
    document = tomlkit.document()
    document.add(tomlkit.comment(f"Set at the live bench, from {scenario.name}."))
    base = _base(scenario, data)
    if base is not None:
        document["extends"] = scenario.name
        values = _differences(base, data)
    else:
        values = dict(_leaves(data))
    now = datetime.now().astimezone().isoformat(timespec="seconds")
    for path, value in values.items():
        _put(document, path, value, _source(scenario, path, value, now))
    return document


def _data(bank: Bank, number: int, loop: ClosedLoop) -> dict[str, Any]:
    """The scenario as plain data, with what the law of a loop has otherwise."""
    data = dict(bank.scenario.data)
    data["law"] = {**dict(data["law"]), "type": bank.names[number]}
    before = {path: value for path, value, _ in numeric_fields(bank.loops[number].law)}
    changed = {p: v for p, v, _ in numeric_fields(loop.law) if v != before.get(p)}
    named = {p if p.startswith("target.") else f"law.{p}": v for p, v in changed.items()}
    return merge(data, _nested({path: _listed(value) for path, value in named.items()}))


def _listed(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value


def _base(scenario: Scenario, data: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """Data of the scenario that ships under that name; None if the file cannot extend it."""
    if scenario.name not in shipped_scenarios():
        return None
    base = load_scenario(scenario.name).data
    merged = merge(base, _nested(_differences(base, data)))
    return base if dict(_leaves(merged)) == dict(_leaves(data)) else None


def _leaves(table: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Every value by its path, lists as lists."""
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from _leaves(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", _listed(value)


def _differences(base: Mapping[str, Any], data: Mapping[str, Any]) -> dict[str, Any]:
    known = dict(_leaves(base))
    return {
        path: value for path, value in _leaves(data) if path not in known or known[path] != value
    }


def _nested(values: Mapping[str, Any]) -> dict[str, Any]:
    made: dict[str, Any] = {}
    for path, value in values.items():
        *tables, key = path.split(".")
        at = made
        for name in tables:
            at = at.setdefault(name, {})
        at[key] = value
    return made


def _source(scenario: Scenario, path: str, value: Any, now: str) -> tuple[str, str] | None:
    """Where a value comes from: what the scenario says, if it is still its value."""
    known = dict(_leaves(scenario.data))
    if path in known and known[path] == value:
        source = scenario.provenance.get(path)
        return None if source is None else (source.kind, source.note)
    return "assumed", f"set at the live bench, {now}"


def _put(document: Any, path: str, value: Any, source: tuple[str, str] | None) -> None:
    *tables, key = path.split(".")
    at = document
    for name in tables:
        at = at.setdefault(name, tomlkit.table())
    if source is None or isinstance(value, dict):
        at[key] = value
        return
    entry = tomlkit.inline_table()
    entry["value"] = value
    entry[source[0]] = source[1]
    at[key] = entry
