"""``alight replay``: a recording once more, on the page or in simulation."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Annotated

import typer

from alight.cli.guard import FAILED
from alight.cli.progress import progress_bar
from alight.errors import AlightError


def replay(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Recording, .mcap or .parquet.")],
    check: Annotated[
        bool,
        typer.Option(
            "--check",
            help="Repeat the run in simulation, from its start and every change made by hand, and "
            "say whether it gives the same numbers; no page.",
        ),
    ] = False,
    port: Annotated[
        int, typer.Option(min=0, max=65535, metavar="N", help="Port of the page; 0 for a free one.")
    ] = 8080,
) -> None:
    """Show a recording on the page of the live bench.

    With --check no page is shown: the run is repeated in simulation, and the exit code is 1 if a
    single number differs.
    """
    if check:
        _check(file)
        return
    if importlib.util.find_spec("nicegui") is None:
        raise AlightError("the page needs the package nicegui: pip install 'alight[live]'")
    from alight.live.page import serve_replay

    serve_replay(file, port)


def _check(file: Path) -> None:
    from alight.live.replay import first_difference, resimulate
    from alight.simulation import Recording

    recording = Recording.load(file)
    with progress_bar(f"repeating {file.name}") as report:
        again = resimulate(recording, progress=report)
    difference = first_difference(recording, again)
    typer.echo(f"{file}: {recording.verdict}")
    if difference is None:
        typer.echo(f"reproduced: {len(recording)} samples of {len(recording.columns)} signals")
        return
    typer.echo(f"not reproduced: {difference}")
    raise typer.Exit(FAILED)
