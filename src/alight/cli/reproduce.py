"""``alight reproduce``: both experiments of the paper, and every claim."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from alight.cli.guard import FAILED
from alight.cli.options import AsJson
from alight.cli.output import output_folder, show, show_json, table
from alight.cli.progress import progress_bar

if TYPE_CHECKING:
    from rich.table import Table

    from alight.reproduction import Reproduction

Results = Annotated[
    Path, typer.Option("--out", metavar="DIR", help="Folder for the files; made if it is missing.")
]


def reproduce(out: Results = Path("results"), as_json: AsJson = False) -> None:
    """Run both experiments of the paper and judge each of its claims.

    Writes report.md, claims.json, Figs. 4 to 8, the strike in plan and as an animation, and the
    recordings of both experiments as Parquet and MCAP. A claim that does not hold is reported as
    such; the exit code is 1 only if an experiment did not run to its end.
    """
    from alight.reproduction import reproduce as reproduce_paper

    with output_folder(out) as folder:
        with progress_bar("reproducing the paper") as report:
            done = reproduce_paper(folder, progress=report)
        if as_json:
            show_json({"claims": [dataclasses.asdict(claim) for claim in done.claims]})
        else:
            show(_table(done), _summary(done, out))
    if not done.complete:
        raise typer.Exit(FAILED)


def _table(done: Reproduction) -> Table:
    made = table(">#", "claim", "published", "simulated", ">ratio (noise)", "holds")
    for claim in done.claims:
        ratio = "" if claim.ratio is None else f"{claim.ratio:.2f}"
        if claim.spread is not None:
            ratio += f" ({claim.spread[0]:.2f}-{claim.spread[1]:.2f})"
        holds = "yes" if claim.holds else "NO"
        made.add_row(
            str(claim.number), claim.statement, claim.published, claim.simulated, ratio, holds
        )
    return made


def _summary(done: Reproduction, out: Path) -> str:
    held = sum(claim.holds for claim in done.claims)
    return f"{held} of {len(done.claims)} claims hold; see {out / 'report.md'}"
