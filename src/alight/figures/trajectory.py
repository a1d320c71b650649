"""Fig. 6: the desired trajectory of the tip."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from alight.figures.style import COLUMN, SOLID, figure_of, new_figure, prepare, set_range, styled
from alight.figures.traces import Trace, draw_traces, tell_ends
from alight.simulation.recording import Recording

INSET_LEFT, INSET_WIDTH, INSET_HEIGHT = 0.40, 0.56, 0.42
"""Place of the inset as shares of the axes."""


@styled
def desired_trajectory(
    limiting: Recording, start: float | None = 0.5, ax: Axes | None = None
) -> Figure:
    """Fig. 6: the desired tip position ``x_rd1`` [m] of (25) over time under (32).

    Parameters
    ----------
    limiting : Recording
        A run under (32).
    start : float, optional
        Length [s] of the first part that an inset shows enlarged; None for none. There is none
        either where the run is not much longer, or ended early.
    ax : Axes, optional
        Where to draw; a new figure if absent.

    Returns
    -------
    Figure
    """
    if ax is None:
        ax = new_figure(None, 1.3 * COLUMN, 2.8).subplots()
    prepare(ax)
    trace = Trace(limiting, "x_rd1", SOLID, "(32)")
    draw_traces(ax, [trace])
    tell_ends(ax, [trace])
    ax.set_xlabel("time [s]")
    ax.set_ylabel("$x_{rd1}$ [m]")
    if start is not None and limiting.verdict.completed and limiting.t[-1] > 4 * start:
        _draw_inset(ax, trace, start)
    return figure_of(ax)


def _draw_inset(ax: Axes, trace: Trace, start: float) -> None:
    """Enlarge the first part where the line leaves room for it, above or below."""
    inset = prepare(ax.inset_axes((INSET_LEFT, _room(ax, trace), INSET_WIDTH, INSET_HEIGHT)))
    trace.draw(inset)
    inset.set_xlim(0.0, start)
    set_range(inset, [trace.values[trace.t <= start]])


def _room(ax: Axes, trace: Trace) -> float:
    """Lower edge of the inset as a share of the axes; the range grows if it does not fit."""
    low, high = ax.get_ylim()
    below = trace.values[trace.t >= 0.8 * INSET_LEFT * trace.t[-1]]
    line_low, line_high = float(np.min(below)), float(np.max(below))
    # 0.2 of the height is for the inset's tick labels and a margin on either side.
    needed = INSET_HEIGHT + 0.2
    if high - line_high >= line_low - low:
        ax.set_ylim(low, max(high, (line_high - needed * low) / (1 - needed)))
        return 1.0 - INSET_HEIGHT - 0.05
    ax.set_ylim(min(low, (line_low - needed * high) / (1 - needed)), high)
    return 0.15
