"""Writing figures so that a file is whole or not there."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from matplotlib.figure import Figure

from alight.errors import AlightError, UnknownName
from alight.figures.style import styled

FORMATS = ("eps", "jpg", "pdf", "png", "ps", "svg", "svgz", "tif", "webp")


class FigureNotWritten(AlightError):
    """A figure that could not be written to its file."""


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Name of a file to write; it takes the place of ``path`` when the block ends well.

    Raises
    ------
    FigureNotWritten
        If the folder does not exist or cannot be written, or the disk is full.
    """
    partial = path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")
    try:
        yield partial
        os.replace(partial, path)
    except OSError as error:
        raise FigureNotWritten(f"{path}: cannot be written: {error.strerror or error}") from error
    finally:
        partial.unlink(missing_ok=True)


@styled
def save(fig: Figure, path: str | Path, dpi: float = 150) -> Path:
    """Write a figure; the suffix of the path chooses the format.

    Parameters
    ----------
    fig : Figure
    path : str or Path
        A file with the suffix png, pdf, svg, ...; its folder must exist.
    dpi : float
        Dots per inch of pixel formats.

    Returns
    -------
    Path
        The file, which is whole: it is written beside its place first.

    Raises
    ------
    UnknownName
        If the suffix is no format of figures.
    FigureNotWritten
        If the file cannot be written.
    """
    path = Path(path)
    kind = path.suffix.lower().removeprefix(".")
    if kind not in FORMATS:
        raise UnknownName("figure format", kind, FORMATS)
    with replacing(path) as partial:
        fig.savefig(partial, format=kind, dpi=dpi)
    return path
