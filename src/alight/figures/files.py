"""Figures and animations as files."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from PIL import Image

from alight.errors import UnknownName
from alight.figures.style import ACCENT, styled
from alight.files import whole_file

FORMATS = ("eps", "jpg", "pdf", "png", "ps", "svg", "svgz", "tif", "webp")


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
        The file, which appears under its name only when it is complete.

    Raises
    ------
    UnknownName
        If the suffix is no format of figures.
    FileError
        If the file cannot be written.
    """
    path = Path(path)
    kind = path.suffix.lower().removeprefix(".")
    if kind not in FORMATS:
        raise UnknownName("figure format", kind, FORMATS)
    with whole_file(path) as file:
        fig.savefig(file, format=kind, dpi=dpi)
    return path


def write_gif(path: Path, pictures: Iterable[Image.Image], frame_ms: int, hold_ms: int) -> None:
    """Write pictures as one endless animation; the last is held longer than the others.

    All share one palette, so that nothing flickers: black to white, and white to `ACCENT` to black.
    """
    palette = _palette()
    kept = [p.quantize(palette=palette, dither=Image.Dither.NONE) for p in pictures]
    durations = [frame_ms] * (len(kept) - 1) + [hold_ms]
    with whole_file(path) as file:
        kept[0].save(
            file,
            format="GIF",
            save_all=True,
            append_images=kept[1:],
            duration=durations,
            loop=0,
            optimize=False,
        )


def _palette() -> Image.Image:
    white, accent, black = np.ones(3), np.array(to_rgb(ACCENT)), np.zeros(3)
    ramps = [(black, white, 32), (white, accent, 16), (accent, black, 8)]
    colors = [np.linspace(start, end, count) for start, end, count in ramps]
    image = Image.new("P", (1, 1))
    image.putpalette(np.rint(255 * np.vstack(colors)).astype(np.uint8).tobytes())
    return image
