"""One look for every figure: fonts, lines, panels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import matplotlib.style
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure

SOLID: dict[str, Any] = {"color": "black", "linestyle": "-", "linewidth": 0.9}
DASHED: dict[str, Any] = {"color": "black", "linestyle": "--", "linewidth": 0.9}
FAINT: dict[str, Any] = {"color": "0.55", "linestyle": ":", "linewidth": 0.8}
ACCENT = "#b2182b"
"""The one colour: contact and its force."""
COLUMN, PAGE = 3.5, 7.16
"""Widths of one and of two columns of a journal [in]."""

_SIZE = 9.0
_FONT = "STIXGeneral"
_SETTINGS: dict[str, Any] = {
    "font.family": _FONT,
    "font.size": _SIZE,
    "mathtext.fontset": "stix",
    "axes.linewidth": 0.6,
    "axes.titlesize": _SIZE,
    "axes.titlepad": 4.0,
    "axes.labelsize": _SIZE,
    "legend.frameon": False,
    "legend.fontsize": _SIZE - 1,
    "lines.solid_capstyle": "round",
    "lines.dashed_pattern": [4.5, 1.8],
}
# Matplotlib makes ticks while it draws, when the settings above no longer hold.
_TICKS: dict[str, Any] = {
    "which": "major",
    "direction": "in",
    "length": 3.0,
    "width": 0.6,
    "color": "black",
    "labelcolor": "black",
    "labelsize": _SIZE - 1,
    "labelfontfamily": _FONT,
    "top": True,
    "right": True,
}

styled = matplotlib.style.context(_SETTINGS, after_reset=True)
"""Decorator: what the function draws has this look; the global settings are restored after it."""


def enlarged(style: Mapping[str, Any]) -> dict[str, Any]:
    """The same line in an enlarged panel, where sensor noise would close the gaps of a dashed one.

    A dashed line becomes grey.
    """
    return {**style, "color": "0.5"} if style["linestyle"] == "--" else dict(style)


def new_figure(fig: Figure | SubFigure | None, width: float, height: float) -> Figure | SubFigure:
    """Return the caller's figure, or a new one of the given size [in]."""
    return fig if fig is not None else Figure(figsize=(width, height), layout="constrained")


def figure_of(drawn: Figure | SubFigure | Axes) -> Figure:
    """The whole figure to which a part of it belongs."""
    found: Any = drawn
    while not isinstance(found, Figure):
        found = found.figure
    return found


def prepare(ax: Axes) -> Axes:
    """Give axes the ticks of this style."""
    ax.tick_params(**_TICKS)
    return ax


def panels(
    fig: Figure | SubFigure, titles: Sequence[str], zoomed: bool
) -> tuple[list[Axes], list[Axes]]:
    """Panels one above the other, labelled (a), (b), ...; with ``zoomed`` a second column.

    Returns
    -------
    paper, zoom : list of Axes
        The panels of the paper, and the narrower ones beside them (an empty list without).
    """
    shape = {"ncols": 2, "width_ratios": [2.2, 1]} if zoomed else {"ncols": 1}
    grid = fig.subplots(len(titles), sharex="col", squeeze=False, **shape)
    for letter, title, ax in zip("abcdefgh", titles, grid[:, 0], strict=False):
        ax.set_title(f"({letter}) {title}".rstrip(), loc="left")
    for ax in grid.flat:
        prepare(ax)
    for ax in grid[-1]:
        ax.set_xlabel("time [s]")
    return list(grid[:, 0]), list(grid[:, 1]) if zoomed else []


def legend_above(ax: Axes) -> None:
    """Legend in one row above the axes, where no line can run through it."""
    ax.legend(
        loc="lower right",
        bbox_to_anchor=(1.0, 1.0),
        ncols=2,
        borderaxespad=0.1,
        handlelength=2.6,
        columnspacing=1.4,
    )


def set_range(ax: Axes, values: Sequence[np.ndarray], margin: float = 0.06) -> None:
    """Vertical range that holds every finite value, with a margin."""
    known = np.concatenate([v[np.isfinite(v)] for v in values])
    low, high = (float(known.min()), float(known.max())) if len(known) else (0.0, 0.0)
    room = margin * (high - low) or margin * max(abs(high), 1.0)
    ax.set_ylim(low - room, high + room)
