"""One signal of one recording as a line, also where the run ended early."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from alight.figures.style import FAINT, enlarged, set_range
from alight.simulation.recording import Recording
from alight.simulation.verdict import Verdict

BLOW_UP = (0.2, 99.8)
"""Percentiles of a run that ended early which its panel shows: the rest is the blow-up."""


@dataclass(frozen=True)
class Trace:
    """A scalar signal of a recording in the unit of its axis, with its line style."""

    recording: Recording
    column: str
    style: Mapping[str, Any]
    label: str
    scale: float = 1.0
    """Factor from the SI unit of the signal to the unit of the axis."""

    @property
    def t(self) -> np.ndarray:
        """Time of each sample [s]."""
        return self.recording.t

    @property
    def values(self) -> np.ndarray:
        """The signal in the unit of the axis."""
        return self.scale * np.asarray(self.recording[self.column])

    def draw(self, ax: Axes) -> None:
        """Add the line to axes."""
        ax.plot(self.t, self.values, label=self.label, **self.style)

    def enlarged(self) -> Trace:
        """The same trace as it looks in an enlarged panel."""
        return dataclasses.replace(self, style=enlarged(self.style))

    @property
    def shown(self) -> np.ndarray:
        """The values that the vertical range must hold."""
        values: np.ndarray = self.values[np.isfinite(self.values)]
        if self.recording.verdict.completed or not len(values):
            return values
        low, high = np.percentile(values, BLOW_UP)
        return np.asarray(values[(values >= low) & (values <= high)])


def draw_traces(ax: Axes, traces: Sequence[Trace]) -> None:
    """Draw traces into axes that span all of them, and show where a run ended early."""
    for trace in traces:
        trace.draw(ax)
        if not trace.recording.verdict.completed:
            ax.axvline(float(trace.t[-1]), **FAINT)
    ax.set_xlim(0.0, max(until(trace.t) for trace in traces))
    set_range(ax, [trace.shown for trace in traces])


def until(t: np.ndarray) -> float:
    """Time [s] up to which the last sample is held."""
    return float(2 * t[-1] - t[-2]) if len(t) > 1 else float(t[-1])


def ended(verdict: Verdict) -> str:
    """How a run ended early, in a few words."""
    how = verdict.outcome.name.lower().replace("_", " ")
    by = f" by {verdict.signal}" if verdict.signal else ""
    return f"{how} at {verdict.time:.4g} s{by}"


def tell_ends(ax: Axes, traces: Sequence[Trace]) -> None:
    """Write above the lines, for each run that ended early, how it ended."""
    early = [trace for trace in traces if not trace.recording.verdict.completed]
    low, high = ax.get_ylim()
    ax.set_ylim(low, high + (0.16 * len(early)) * (high - low))
    for row, trace in enumerate(early):
        at = float(trace.t[-1])
        left = at > sum(ax.get_xlim()) / 2
        ax.annotate(
            f"{trace.label}: {ended(trace.recording.verdict)}",
            (at, 0.96 - 0.12 * row),
            xycoords=("data", "axes fraction"),
            xytext=(-4 if left else 4, 0),
            textcoords="offset points",
            ha="right" if left else "left",
            va="top",
            fontsize=8,
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.0},
        )


def first_contact(recording: Recording) -> int | None:
    """Index of the first sample in contact; None if the tip never touches the body."""
    touching = np.flatnonzero(recording["Lambda"] > 0)
    return int(touching[0]) if len(touching) else None
