"""Arguments and options that more than one command has."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer


class BackendName(StrEnum):
    """The backends of `alight.kernels`, which this module must not import."""

    auto = "auto"
    vm = "vm"
    c = "c"
    lanes = "lanes"


ScenarioName = Annotated[
    str,
    typer.Argument(
        metavar="SCENARIO",
        help="Name of a shipped scenario (see *alight scenarios*) or path of a TOML file.",
    ),
]
Settings = Annotated[
    list[str],
    typer.Option(
        "--set",
        metavar="PATH=VALUE",
        help="Replace a value of the scenario, in TOML's notation: plant.body.m=2.5. Repeatable.",
        default_factory=list,
        show_default=False,
    ),
]
OutFolder = Annotated[
    Path | None,
    typer.Option("--out", metavar="DIR", help="Folder for the files; made if it is missing."),
]
AsJson = Annotated[
    bool, typer.Option("--json", help="Print JSON in SI units, and nothing else, on stdout.")
]
Backend = Annotated[
    BackendName,
    typer.Option(help="Compiled C, or CasADi's virtual machine; auto compiles when that pays."),
]
Seed = Annotated[
    int | None,
    typer.Option(min=0, metavar="N", help="Seed of the sensor noise instead of the scenario's."),
]
