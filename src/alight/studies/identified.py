"""The result of a search, and the scenario files that hold it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tomlkit

from alight.files import whole_file
from alight.models.arm import Elbow
from alight.scenarios.shipped import shipped_file
from alight.studies.misfit import Candidate
from alight.studies.unknowns import settings_of

DIGITS = 12
"""Significant digits of a value in a scenario file."""


@dataclass(frozen=True)
class Identified:
    """The result of a search."""

    best: Candidate
    elbow: Elbow
    generations: int
    seed: int
    wide: bool
    """Whether the search started at random, and not at the plant shipped before."""

    @property
    def kind(self) -> str:
        """Whether the theory applies: whether the projection boxes hold the true parameters."""
        return (
            "The projection boxes hold the true theta_r and theta_dk, so that the theory applies; "
            "the ranges of the search allow nothing else."
        )


def write_identified(folder: Path, found: Identified) -> None:
    """Write both experiments, with the identified values and the cost table as provenance."""
    both, second = settings_of(found.best.values, found.elbow)
    one = tomlkit.parse(shipped_file("experiment-1").read_text("utf-8"))
    _set_all(one, both)
    one["provenance"] = {"identification": _provenance(found)}
    two = tomlkit.parse(shipped_file("experiment-2").read_text("utf-8"))
    _set_all(two, second)
    for name, document in (("experiment-1", one), ("experiment-2", two)):
        with whole_file(folder / f"{name}.toml") as file:
            file.write(tomlkit.dumps(document).encode())


def _provenance(found: Identified) -> dict[str, Any]:
    return {
        "command": f"alight identify --seed {found.seed} --generations {found.generations}"
        f" --elbow {found.elbow}{' --wide' if found.wide else ''}",
        "started": "at random" if found.wide else "at the plant shipped before, found likewise",
        "kind": found.kind,
        "unknowns": {name: _rounded(value) for name, value in found.best.values.items()},
        "costs": {name: float(f"{cost:.4g}") for name, cost in found.best.costs.items()},
    }


def _set_all(document: Any, values: Mapping[str, Any]) -> None:
    for path, value in values.items():
        *tables, key = path.split(".")
        table = document
        for name in tables:
            table = table.setdefault(name, tomlkit.table())
        if not isinstance(table.get(key), Mapping):
            table[key] = tomlkit.inline_table()
            table[key]["assumed"] = "identified"
        table[key]["value"] = _rounded(value)


def _rounded(value: Any) -> Any:
    if isinstance(value, (list, tuple)):
        return [_rounded(entry) for entry in value]
    return float(f"{value:.{DIGITS}g}") if isinstance(value, float) else value
