"""Where a command puts its results: stdout, a folder."""

from __future__ import annotations

import contextlib
import json
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import Console, RenderableType
from rich.table import Table as Printed

from alight.cli.guard import writing_output
from alight.files import FileError, whole_file
from alight.tables import Table

PIPE_WIDTH = 140
"""Columns of a table that does not go to a terminal."""


def show(*parts: RenderableType) -> None:
    """Print texts and tables on stdout."""
    console = Console(highlight=False, markup=False, emoji=False)
    if not console.is_terminal:
        console.width = PIPE_WIDTH
    with writing_output():
        for part in parts:
            console.print(part)


def table(*columns: str, title: str | None = None) -> Printed:
    """Return an empty table in Alight's style; a column ``>name`` is aligned to the right."""
    made = Printed(box=SIMPLE_HEAD, title=title, title_justify="left", pad_edge=False)
    for column in columns:
        right = column.startswith(">")
        made.add_column(column.removeprefix(">"), justify="right" if right else "left")
    return made


def show_tables(tables: Sequence[Table]) -> None:
    """Print tables with their notes on stdout."""
    for given in tables:
        made = table(*given.columns, title=given.title)
        made.show_header = any(given.columns)
        for row in given.rows:
            made.add_row(*row)
        show(made, *(f"{note}\n" for note in given.notes))


def show_json(content: Mapping[str, Any]) -> None:
    """Print JSON on stdout."""
    with writing_output():
        print(_json(content))


def write_json(content: Mapping[str, Any], path: Path) -> None:
    """Write a JSON file, whole or not at all.

    Raises
    ------
    FileError
        If it cannot be written.
    """
    with whole_file(path) as file:
        file.write(f"{_json(content)}\n".encode())


def _json(content: Mapping[str, Any]) -> str:
    return json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False, default=str)


@contextlib.contextmanager
def output_folder(path: Path | None) -> Iterator[Path | None]:
    """Make a folder, and find out that it can be written before the work begins.

    If the work fails with the folder still empty, a folder that was made here is removed.

    Raises
    ------
    FileError
        If there can be no such folder, or it refuses files.
    """
    if path is None:
        yield None
        return
    made = _make(path)
    try:
        yield path
    except BaseException:
        for folder in made:
            with contextlib.suppress(OSError):
                folder.rmdir()
        raise


def _make(path: Path) -> list[Path]:
    """Make a folder and those above it; return those that were missing, the deepest first."""
    try:
        made = [folder for folder in (path, *path.parents) if not folder.exists()]
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path):
            return made
    except FileExistsError:
        raise FileError(path, "is a file; --out needs a folder") from None
    except OSError as error:
        problem = f"no files can be written into this folder: {error.strerror or error}"
        raise FileError(path, problem) from error
