"""Fig. 4: the errors of tip and mass under both laws."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure

from alight.figures.style import (
    DASHED,
    FAINT,
    PAGE,
    SOLID,
    figure_of,
    legend_above,
    new_figure,
    panels,
    set_range,
    styled,
)
from alight.figures.traces import Trace, draw_traces, tell_ends, until
from alight.simulation.recording import Recording


class _Panel(NamedTuple):
    column: str
    symbol: str
    steady_unit: str
    steady_scale: float


_PANELS = (
    _Panel("e_r1", "e_{r1}", "mm", 1e3),
    _Panel("e_r2", "e_{r2}", "mm", 1e3),
    _Panel("e_m", "e_m", "µm", 1e6),
)


@styled
def errors(
    limiting: Recording,
    unsaturated: Recording,
    steady_state: float | None = 2.0,
    fig: Figure | SubFigure | None = None,
) -> Figure:
    """Fig. 4: (a) ``e_r1``, (b) ``e_r2`` and (c) ``e_m`` in millimetres over time.

    Parameters
    ----------
    limiting, unsaturated : Recording
        A run under (32), drawn solid, and one under (44), drawn dashed. They may differ in length;
        where one ended early, its end is marked with its verdict.
    steady_state : float, optional
        Length [s] of the last part of each run that is shown enlarged beside its panel, with its
        peak. None, or runs that ended early or are no longer than that: no such column.
    fig : Figure or SubFigure, optional
        Where to draw; a new figure if absent.

    Returns
    -------
    Figure
    """
    runs = [
        (limiting, SOLID, "force limiting, (32)"),
        (unsaturated, DASHED, "unsaturated, (44)"),
    ]
    settled = [
        run
        for run in runs
        if steady_state and run[0].verdict.completed and run[0].t[-1] > steady_state
    ]
    fig = new_figure(fig, PAGE if settled else 0.7 * PAGE, 5.2)
    paper, zoom = panels(fig, [""] * len(_PANELS), zoomed=bool(settled))
    for ax, panel in zip(paper, _PANELS, strict=True):
        traces = [Trace(r, panel.column, style, label, 1e3) for r, style, label in runs]
        draw_traces(ax, traces)
        ax.set_ylabel(f"${panel.symbol}$ [mm]")
        if ax is paper[0]:
            legend_above(ax)
            tell_ends(ax, traces)
    for ax, panel in zip(zoom, _PANELS, strict=False):
        tails = [(r.last(steady_state or 0.0), style) for r, style, _ in settled]
        _draw_steady_state(ax, panel, tails)
    return figure_of(fig)


def _draw_steady_state(
    ax: Axes, panel: _Panel, tails: Sequence[tuple[Recording, dict[str, object]]]
) -> None:
    """Draw the last part of runs, each with its peak."""
    traces = []
    for tail, style in tails:
        peak = panel.steady_scale * tail.peak(panel.column)
        label = f"peak {peak:.3g} {panel.steady_unit}"
        trace = Trace(tail, panel.column, style, label, panel.steady_scale)
        traces.append(trace.enlarged())
    for trace in traces:
        trace.draw(ax)
    ax.axhline(0.0, **FAINT)
    set_range(ax, [np.zeros(1), *(trace.values for trace in traces)])
    ax.set_xlim(min(float(x.t[0]) for x in traces), max(until(x.t) for x in traces))
    ax.set_ylabel(f"${panel.symbol}$ [{panel.steady_unit}]")
    legend_above(ax)
