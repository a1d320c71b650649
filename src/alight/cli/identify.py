"""``alight identify``: the plant that the paper does not print."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from alight.cli.output import output_folder, show, table
from alight.cli.progress import progress_bar

Found = Annotated[
    Path, typer.Option("--out", metavar="DIR", help="Folder for the log and both scenarios.")
]
Generations = Annotated[int, typer.Option(min=1, help="Generations of the search in all.")]
SearchSeed = Annotated[int, typer.Option(min=0, metavar="N", help="Seed of the search.")]


class Sign(StrEnum):
    """Sign of the second joint angle."""

    plus = "+"
    minus = "-"


Elbow = Annotated[Sign, typer.Option(help="Sign of the second joint angle.")]
Wide = Annotated[bool, typer.Option("--wide", help="Start at random, not at the shipped plant.")]


def identify(
    out: Found = Path("identified"),
    generations: Generations = 200,
    seed: SearchSeed = 1,
    elbow: Elbow = Sign.plus,
    wide: Wide = False,
) -> None:
    """Search for one plant that gives both experiments their published errors.

    Writes identification.json, the log of the search, and experiment-1.toml and
    experiment-2.toml with the plant found and its cost table. The same command with the same
    folder goes on where it stopped, after Ctrl-C too.
    """
    from alight.studies import identify as search

    with output_folder(out), progress_bar("searching") as report:
        found = search(
            out, generations=generations, seed=seed, elbow=elbow.value, wide=wide, progress=report
        )
    made = table("term", ">cost")
    for term, cost in found.best.costs.items():
        made.add_row(term, f"{cost:.3f}")
    made.add_row("sum", f"{found.best.cost:.3f}")
    show(made, f"{found.generations} generations; {found.kind}")
