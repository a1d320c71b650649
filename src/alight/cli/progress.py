"""A progress bar for whatever takes longer than two seconds."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Iterator
from typing import Protocol

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

PATIENCE = 2.0
"""Seconds without a bar."""


class Report(Protocol):
    """Told the share that is done, from 0 to 1, and what is done now if that has changed."""

    def __call__(self, share: float, what: str | None = None) -> None:
        """Take the share."""


@contextlib.contextmanager
def progress_bar(what: str) -> Iterator[Report]:
    """Show percentage and time remaining on the terminal, once two seconds have passed.

    Before the first report the bar only moves, as while a program is compiled. Where stderr is
    no terminal nothing is shown.

    Parameters
    ----------
    what : str
        What takes so long, in a few words.

    Yields
    ------
    Report
        To be told the share that is done.
    """
    console = Console(stderr=True)
    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TaskProgressColumn(),
        TimeRemainingColumn(),
    )
    bar = Progress(*columns, console=console, transient=True, disable=not console.is_terminal)
    task = bar.add_task(what, total=None)

    def report(share: float, what: str | None = None) -> None:
        bar.update(task, total=1.0, completed=share, description=what)

    timer = threading.Timer(PATIENCE, bar.start)
    timer.daemon = True
    timer.start()
    try:
        yield report
    finally:
        timer.cancel()
        timer.join()
        bar.stop()
