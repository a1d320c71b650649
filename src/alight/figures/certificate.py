"""What a certificate says better in a picture: V and V_r along a run, the stable region."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from alight.figures.style import (
    ACCENT,
    COLUMN,
    DASHED,
    FAINT,
    PAGE,
    SOLID,
    figure_of,
    new_figure,
    panels,
    prepare,
    styled,
)

DECADE = 10.0
"""Ratio of greatest to least value from which on an axis is logarithmic."""


@styled
def lyapunov(
    t: np.ndarray,
    values: Mapping[str, np.ndarray],
    bounds: Mapping[str, Mapping[str, np.ndarray]],
    contact: np.ndarray,
    start: float = 0.5,
    fig: Figure | SubFigure | None = None,
) -> Figure:
    """Lyapunov functions over time, each in its panel with its bounds.

    Parameters
    ----------
    t : (n,) array
        Times [s].
    values : mapping of str to (n,) array
        Each function [J] by its symbol, such as ``"V_r"``.
    bounds : mapping of str to mapping of str to (n,) array
        For some of them, by name, what they may not exceed [J].
    contact : (n,) array of bool
        Where the tip touches the body: shaded.
    start : float
        Length [s] of the first part that is shown enlarged beside each panel.
    fig : Figure or SubFigure, optional
        Where to draw; a new figure if absent.

    Returns
    -------
    Figure
    """
    fig = new_figure(fig, PAGE, 1.9 * len(values))
    whole, early = panels(fig, [""] * len(values), zoomed=True)
    for axes, end in ((whole, float(t[-1])), (early, min(start, float(t[-1])))):
        shown = t <= end
        for ax, (name, value) in zip(axes, values.items(), strict=True):
            _shade(ax, t[shown], contact[shown])
            ax.plot(t[shown], value[shown], label=f"${name}$", **SOLID)
            for (told, bound), style in zip(
                bounds.get(name, {}).items(), (DASHED, FAINT), strict=False
            ):
                ax.plot(t[shown], np.broadcast_to(bound, t.shape)[shown], label=told, **style)
            if value[shown].min() * DECADE < value[shown].max():
                ax.set_yscale("log")
            ax.set_xlim(0.0, end)
    for ax, name in zip(whole, values, strict=True):
        ax.set_ylabel(f"${name}$ [J]")
        _legend_above(ax)
    return figure_of(fig)


def _legend_above(ax: Axes) -> None:
    if len(ax.get_lines()) > 1:
        ax.legend(
            loc="lower right",
            bbox_to_anchor=(1.0, 1.0),
            ncols=3,
            borderaxespad=0.1,
            columnspacing=1.0,
        )


def _shade(ax: Axes, t: np.ndarray, contact: np.ndarray) -> None:
    edges = np.flatnonzero(np.diff(np.concatenate([[False], contact, [False]]).astype(int)))
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        ax.axvspan(
            float(t[first]), float(t[min(last, len(t) - 1)]), color=ACCENT, alpha=0.1, linewidth=0
        )


@styled
def stable_region(
    alpha1: np.ndarray,
    k1: np.ndarray,
    margins: Mapping[str, np.ndarray],
    points: Mapping[str, tuple[float, float]],
    ax: Axes | None = None,
) -> Figure:
    """Where conditions hold in the plane of ``alpha1`` and ``k1``, with some gain sets in it.

    Parameters
    ----------
    alpha1 : (n,) array
        Abscissa [1/s].
    k1 : (m,) array
        Ordinate.
    margins : mapping of str to (m, n) array
        Margin of each condition, positive where it holds. The region of the last is filled; of
        each other the border is drawn, with its name.
    points : mapping of str to pair
        Gain sets by name, ``(alpha1, k1)``: the first as a dot, the others as rings.
    ax : Axes, optional
        Where to draw; a new figure if absent.

    Returns
    -------
    Figure
    """
    if ax is None:
        ax = new_figure(None, 1.5 * COLUMN, 1.25 * COLUMN).subplots()
    prepare(ax)
    ax.set_xscale("log")
    ax.set_yscale("log")
    *bordered, (filled, inside) = margins.items()
    handles: list[Line2D | Patch] = []
    for style, (name, margin) in zip((SOLID, DASHED, FAINT), bordered, strict=False):
        look = {"colors": style["color"], "linestyles": style["linestyle"]}
        ax.contour(alpha1, k1, margin, levels=[0.0], linewidths=style["linewidth"], **look)
        handles.append(Line2D([], [], label=f"{name}: holds on its left", **style))
    ax.contourf(alpha1, k1, inside, levels=[0.0, np.inf], colors=["0.85"])
    handles.append(Patch(facecolor="0.85", label=f"{filled} holds"))
    for i, (name, point) in enumerate(points.items()):
        look = {"markerfacecolor": ACCENT if i == 0 else "white", "markeredgecolor": ACCENT}
        ax.plot(*point, "o", markersize=5, **look)
        handles.append(Line2D([], [], marker="o", linestyle="", label=name, **look))
    ax.set_xlabel(r"$\alpha_1$ [1/s]")
    ax.set_ylabel("$k_1$")
    ax.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.5, -0.13), ncols=2)
    return figure_of(ax)
