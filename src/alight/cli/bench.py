"""``alight bench``: Alight against its peers, and against its budget, on this machine."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from alight.cli.options import AsJson, OutFolder
from alight.cli.output import output_folder, show_json, show_tables, write_json
from alight.cli.progress import progress_bar
from alight.files import whole_file
from alight.tables import markdown

Only = Annotated[
    list[str],
    typer.Option(
        "--only",
        metavar="NAME",
        help="A package to compare with (numpy, scipy, numba, jax, mujoco, drake, control, "
        "jaxonomy), or a part: runs, batch, law, threads, lanes, costs, floor, accuracy, live. "
        "Repeatable.",
        default_factory=list,
        show_default=False,
    ),
]
Quick = Annotated[bool, typer.Option("--quick", help="Few and short samples: to see that it runs.")]


def bench(only: Only, quick: Quick = False, out: OutFolder = None, as_json: AsJson = False) -> None:
    """Measure Alight and the tools one would take instead, on one core of this machine.

    Every time is a ratio to plain C that does the same, taken by turns with it, and stands with
    its spread and the error of the result. Packages that are missing are named, with what to
    install; the extra *bench* has them all.

    With --out the figures are kept: benchmarks.json, benchmarks.md as the documentation shows
    them, benchmarks.png with the errors.
    """
    from alight_benchmarks.own.machine import one_core
    from alight_benchmarks.own.report import tables

    with output_folder(out) as folder, one_core() as processors:
        results = _measured(only, quick, processors)
        if as_json:
            show_json(results)
        else:
            show_tables(tables(results))
        if folder is not None:
            _keep(results, folder)


def _measured(only: list[str], quick: bool, processors: list[int]) -> dict[str, Any]:
    # Only now: libraries look at the number of threads when they are imported.
    from alight_benchmarks.own.bench import measure
    from alight_benchmarks.own.budget import budget
    from alight_benchmarks.own.ratios import FULL, QUICK

    with progress_bar("benchmark") as report:
        found = measure(only, QUICK if quick else FULL, processors, report)
    command = ["alight bench", *(f"--only {name}" for name in only), *["--quick"] * quick]
    lines = budget(found["sections"])
    return {"command": " ".join(command), "quick": quick, **found, "budget": lines}


def _keep(results: dict[str, Any], folder: Path) -> None:
    from alight_benchmarks.own.report import tables

    write_json(results, folder / "benchmarks.json")
    with whole_file(folder / "benchmarks.md") as file:
        file.write(markdown(tables(results)).encode("utf-8"))
    if "accuracy" in results["sections"]:
        from alight.figures import save
        from alight_benchmarks.own.figure import convergence

        save(convergence(results["sections"]["accuracy"]), folder / "benchmarks.png")
