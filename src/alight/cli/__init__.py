"""The command line: one thin command per verb.

Commands import what they need when they run, so that ``alight --help`` is there at once.
"""

from __future__ import annotations

import sys
from typing import Annotated

import typer

import alight
from alight.cli.bench import bench
from alight.cli.check import check
from alight.cli.guard import add, example_text
from alight.cli.identify import identify
from alight.cli.live import live
from alight.cli.replay import replay
from alight.cli.reproduce import reproduce
from alight.cli.run import run
from alight.cli.scenarios import scenarios

app = typer.Typer(
    name="alight",
    help="Simulate, check and reproduce control of a robot at the moment it touches something.",
    epilog=example_text("alight run experiment-1"),
    no_args_is_help=True,
    rich_markup_mode="markdown",
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)
add(app, reproduce, example="alight reproduce --out results")
add(app, run, example="alight run experiment-1 --set duration=2 --set steady_state=1 --out strike")
add(app, check, example="alight check experiment-1 --set law.gains.alpha1=25 --out certificate")
add(app, scenarios, example="alight scenarios experiment-1")
add(app, live, example="alight live experiment-1 --out recordings")
add(app, bench, example="alight bench --only scipy --only batch")
add(app, identify, example="alight identify --out identified --generations 400 --seed 2")
add(app, replay, example="alight replay recordings/experiment-1-20260102-030405.mcap --check")


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(alight.__version__)
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_print_version, is_eager=True, help="Print the version and exit."
        ),
    ] = False,
) -> None:
    """Take what stands before the verb."""


def main() -> None:
    """Entry point of the command ``alight``."""
    # A law package.module:Class may stand in the current folder; what is installed goes first.
    sys.path.append("")
    app(prog_name="alight")
