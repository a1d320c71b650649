"""Figs. 5, 7 and 8: the torques of both motors, as computed and as applied."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

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
from alight.figures.traces import Trace, draw_traces, first_contact, tell_ends
from alight.simulation.recording import Recording

MOTORS = ("base motor", "second link motor")
OFF_SCALE = 3.0
"""Fig. 8 shows computed torques up to this multiple of the largest applied one."""


@styled
def torques(
    limiting: Recording, start: float | None = 1.0, fig: Figure | SubFigure | None = None
) -> Figure:
    """Fig. 5: torques applied under (32) at (a) the base and (b) the second link motor.

    Parameters
    ----------
    limiting : Recording
        A run under (32).
    start : float, optional
        Length [s] of the first part that is shown enlarged beside each panel; None for none.
    fig : Figure or SubFigure, optional
        Where to draw; a new figure if absent.

    Returns
    -------
    Figure
    """
    fig, paper, zoom = _motor_panels(fig, limiting, start)
    lines = [Trace(limiting, "tau_applied", SOLID, "applied")]
    _draw_motors(paper, zoom, lines, start)
    return figure_of(fig)


@styled
def computed_torques(
    unsaturated: Recording, start: float | None = 1.0, fig: Figure | SubFigure | None = None
) -> Figure:
    """Fig. 7: torques computed by (44) for (a) the base and (b) the second link motor.

    Parameters
    ----------
    unsaturated : Recording
        A run under (44).
    start : float, optional
        Length [s] of the first part that is shown enlarged beside each panel; None for none.
    fig : Figure or SubFigure, optional
        Where to draw; a new figure if absent.

    Returns
    -------
    Figure
    """
    fig, paper, zoom = _motor_panels(fig, unsaturated, start)
    lines = [Trace(unsaturated, "tau", SOLID, "computed")]
    _draw_motors(paper, zoom, lines, start)
    return figure_of(fig)


@styled
def applied_against_computed(
    unsaturated: Recording, start: float | None = 1.0, fig: Figure | SubFigure | None = None
) -> Figure:
    """Fig. 8: torques applied (solid) and computed by (44) (dashed), both motors.

    The computed torques can exceed the applied ones many times. Where they do, the panels of the
    paper are cut at three times the largest applied torque and say how far the computed ones go;
    the panels of the first part are not cut.

    Parameters
    ----------
    unsaturated : Recording
        A run under (44).
    start : float, optional
        Length [s] of the first part that is shown enlarged beside each panel; None for none.
    fig : Figure or SubFigure, optional
        Where to draw; a new figure if absent.

    Returns
    -------
    Figure
    """
    fig, paper, zoom = _motor_panels(fig, unsaturated, start)
    lines = [
        Trace(unsaturated, "tau_applied", SOLID, "applied"),
        Trace(unsaturated, "tau", {**DASHED, "zorder": 1.9}, "computed"),
    ]
    _draw_motors(paper, zoom, lines, start)
    legend_above(paper[0])
    for motor, ax in enumerate(paper, start=1):
        _cut(ax, unsaturated[f"tau_applied{motor}"], unsaturated[f"tau{motor}"])
    return figure_of(fig)


def _motor_panels(
    fig: Figure | SubFigure | None, recording: Recording, start: float | None
) -> tuple[Figure | SubFigure, list[Axes], list[Axes]]:
    zoomed = start is not None and bool(recording.t[-1] > start)
    fig = new_figure(fig, PAGE if zoomed else 0.7 * PAGE, 3.9)
    return fig, *panels(fig, MOTORS, zoomed)


def _draw_motors(
    paper: Sequence[Axes], zoom: Sequence[Axes], lines: Sequence[Trace], start: float | None
) -> None:
    """Draw lines of both motors into the panels of the paper and of the first part."""
    for motor, ax in enumerate(paper, start=1):
        traces = [_of_motor(line, motor) for line in lines]
        draw_traces(ax, traces)
        ax.set_ylabel(rf"$\tau_{motor}$ [N m]")
    tell_ends(paper[0], lines[:1])
    for motor, ax in enumerate(zoom, start=1):
        traces = [_of_motor(line, motor).enlarged() for line in lines]
        _draw_start(ax, traces, start or 0.0, named=motor == 1)


def _of_motor(line: Trace, motor: int) -> Trace:
    return dataclasses.replace(line, column=f"{line.column}{motor}")


def _draw_start(ax: Axes, traces: Sequence[Trace], start: float, named: bool) -> None:
    """Draw the first part of a run; the first contact is marked, and named if ``named``."""
    for trace in traces:
        trace.draw(ax)
    recording = traces[0].recording
    set_range(ax, [trace.values[trace.t <= start] for trace in traces])
    ax.set_xlim(0.0, start)
    touch = first_contact(recording)
    if touch is None or recording.t[touch] > start:
        return
    at = float(recording.t[touch])
    ax.axvline(at, **FAINT)
    if named:
        ax.annotate(
            "contact",
            (at, 1.0),
            xycoords=("data", "axes fraction"),
            xytext=(0, 3),
            textcoords="offset points",
            ha="center",
            fontsize=8,
        )


def _cut(ax: Axes, applied: np.ndarray, computed: np.ndarray) -> None:
    """Limit the range to what is applied, and say how far the computed torque goes beyond."""
    known = computed[np.isfinite(computed)]
    bound = OFF_SCALE * float(np.nanmax(np.abs(applied)))
    low, high = float(known.min()), float(known.max())
    if bound == 0 or (-bound <= low and high <= bound):
        return
    ax.set_ylim(max(-bound, 1.06 * low), min(bound, 1.06 * high))
    reach = f"{low:.0f} to {high:.0f}".replace("-", "\u2212")
    ax.annotate(
        f"cut: computed torque spans {reach} N m",
        (0.985, 0.95),
        xycoords="axes fraction",
        ha="right",
        va="top",
        fontsize=8,
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.0},
    )
