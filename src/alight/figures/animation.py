"""The strike as a moving picture."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from alight.errors import AlightError
from alight.figures import scene
from alight.figures.files import replacing
from alight.figures.style import ACCENT, FAINT, figure_of, new_figure, prepare, set_range, styled
from alight.figures.traces import first_contact
from alight.scenarios.scenario import Scenario
from alight.simulation.recording import Recording

FRAME_MS = 40
"""Time for which a frame is shown; players do not honour much shorter ones."""
HOLD_MS = 2000
"""Time for which the last frame is shown."""
BEFORE, AFTER, BEYOND = 0.008, 0.06, 1.0
"""Slowest part of the film, before and after the first contact, and its end after that [s]."""
SHARES = (0.3, 0.4, 0.3)
"""Shares of the frames: approach, impact, what follows."""
COLORS = 48
DPI = 100


class Storyboard(NamedTuple):
    """Which samples of a recording the frames show."""

    samples: np.ndarray
    """Sample of each frame, ascending."""
    slowdown: np.ndarray
    """How many times slower than in truth the film runs at each frame."""


def storyboard(recording: Recording, frames: int, until: float | None = None) -> Storyboard:
    """Spread frames over a recording, so that the impact runs in slow motion.

    Parameters
    ----------
    recording : Recording
    frames : int
        Number of frames, from 2 to the number of samples shown.
    until : float, optional
        End of the film [s]; by default a second after the first contact, or the recording's end.

    Raises
    ------
    AlightError
        If there are too few or too many frames.
    """
    t, touch = recording.t, first_contact(recording)
    end = t[-1] if touch is None else t[touch] + BEYOND
    end = float(min(t[-1], end if until is None else until))
    last = int(np.searchsorted(t, end))
    if not 2 <= frames <= last + 1:
        raise AlightError(f"frames = {frames}: must be from 2 to {last + 1}, the samples shown")
    edges = [0.0, end] if touch is None else [0.0, t[touch] - BEFORE, t[touch] + AFTER, end]
    edges = list(np.clip(edges, 0.0, end))
    shares = np.array((1.0,) if touch is None else SHARES) * (np.diff(edges) > 0)
    knots = np.concatenate([[0.0], np.cumsum(shares / shares.sum())])
    times = np.interp(np.linspace(0.0, 1.0, frames), knots, edges)
    passing = np.gradient(times) / (FRAME_MS / 1000)
    return Storyboard(_distinct(np.searchsorted(t, times), last), 1 / np.maximum(passing, 1e-9))


def _distinct(samples: np.ndarray, last: int) -> np.ndarray:
    """The nearest strictly ascending samples that end at ``last`` or before."""
    order = np.arange(len(samples))
    ascending = np.maximum.accumulate(samples - order) + order
    found: np.ndarray = np.minimum(ascending, last - order[::-1])
    return found


@styled
def animate(
    recording: Recording,
    scenario: Scenario,
    path: str | Path,
    frames: int = 160,
    until: float | None = None,
    fig: Figure | None = None,
) -> Figure:
    """Write the strike as a GIF: arm and body in plan, impact force, compression, magnified contact.

    Parameters
    ----------
    recording : Recording
        A run of the scenario.
    scenario : Scenario
        Whose arm, body and target are drawn.
    path : str or Path
        A file with the suffix gif.
    frames : int
        Number of frames.
    until : float, optional
        End of the film [s]; by default a second after the first contact, or the recording's end.
    fig : Figure, optional
        Where to draw; a new figure if absent.

    Returns
    -------
    Figure
        As it stands in the last frame.

    Raises
    ------
    AlightError
        If the suffix is another one, the number of frames is out of range, or the file cannot be
        written.
    """
    path = Path(path)
    if path.suffix.lower() != ".gif":
        raise AlightError(f"{path}: an animation is written as a .gif")
    board = storyboard(recording, frames, until)
    figure = figure_of(new_figure(fig, 9.0, 4.8))
    if fig is None:
        figure.set_dpi(DPI)
    film = _Film(figure, recording, scenario, board)
    _write_gif(path, film.pictures())
    return figure


class _Film:
    """The figure of an animation and everything in it that moves."""

    def __init__(
        self, fig: Figure, recording: Recording, scenario: Scenario, board: Storyboard
    ) -> None:
        self.recording, self.board = recording, board
        self.canvas = FigureCanvasAgg(fig)
        self.motion = scene.motion_of(recording, scenario)
        self.clearance = scenario.testbed.probe.clearance
        grid = fig.add_gridspec(3, 2, width_ratios=[1.7, 1], height_ratios=[1.1, 1.1, 1])
        self._set_plan(fig.add_subplot(grid[:, 0]), scenario)
        self._set_strips(fig.add_subplot(grid[0, 1]), fig.add_subplot(grid[1, 1]), scenario)
        self._set_lens(fig.add_subplot(grid[2, 1]))
        for artist in self.moving:
            artist.set_animated(True)

    def _set_plan(self, ax: Axes, scenario: Scenario) -> None:
        prepare(ax)
        motion, target = self.motion, scenario.target
        span = scene.plate_span(motion, target.x_rd2)
        self.body = scene.Body(ax, span, scene.wall_of(scenario))
        scene.frame_scene(ax, motion, self.board.samples, self.body)
        ax.plot([target.x_md] * 2, span, color=ACCENT, linewidth=0.9, linestyle="--")
        ax.plot(target.x_md, target.x_rd2, "+", color=ACCENT, markersize=9)
        scene.draw_base(ax)
        (self.path,) = ax.plot([], [], color="0.4", linewidth=0.8)
        (self.arm,) = ax.plot([], [], "o-", color="black", linewidth=3.0, markersize=5,
                              markerfacecolor="white", zorder=3)
        self.clock = ax.set_title(" ", loc="left", fontsize=11)
        self.speed = ax.set_title(" ", loc="right", fontsize=9)

    def _set_strips(self, force: Axes, compression: Axes, scenario: Scenario) -> None:
        shown = slice(0, int(self.board.samples[-1]) + 1)
        t = self.recording.t
        x_0 = scenario.plant.body.x_0
        self.series = (self.recording["F_m"], 1e3 * (self.recording["x_m"] - x_0))
        labels = ("impact force $F_m$ [N]", "compression $x_m - x_0$ [mm]")
        goal = 1e3 * (scenario.target.x_md - x_0)
        self.strips, self.heads = [], []
        for ax, values, label in zip((force, compression), self.series, labels, strict=True):
            prepare(ax).set_title(label, loc="left")
            ax.set_xlim(0.0, t[shown][-1])
            set_range(ax, [values[shown], np.array([goal if ax is compression else 0.0])])
            self.strips += ax.plot([], [], color="black", linewidth=0.9)
            self.heads += ax.plot([], [], "o", color=ACCENT, markersize=4)
        compression.axhline(goal, color=ACCENT, linewidth=0.9, linestyle="--")
        compression.set_xlabel("time [s]")

    def _set_lens(self, ax: Axes) -> None:
        """The contact in millimetres, seen from the body: tip, plate and probe."""
        prepare(ax).set_title("seen from the body, magnified [mm]", loc="left")
        deepest = max(1e3 * self.clearance, *(1e3 * (self.motion.face - self.motion.x_m)))
        ax.set_xlim(-2.0 * deepest, 1.6 * deepest)
        ax.set_ylim(-1.0, 1.0)
        ax.set_yticks([])
        ax.axvline(0.0, **FAINT)
        ax.axvspan(1e3 * self.clearance, 1.6 * deepest, color="0.4", linewidth=0)
        ax.annotate("probe", (1e3 * self.clearance, -0.8), xytext=(3, 0), fontsize=8,
                    textcoords="offset points", color="white")
        (self.lens_plate,) = ax.plot([], [], color="black", linewidth=3.5, solid_capstyle="butt")
        (self.lens_tip,) = ax.plot([], [], ">", color="black", markersize=9, clip_on=True)

    @property
    def moving(self) -> list[Any]:
        """Everything that moves, the lowest first."""
        return [
            self.path, *self.body.artists, self.arm, self.clock, self.speed,
            *self.strips, *self.heads, self.lens_plate, self.lens_tip,
        ]

    def _place(self, frame: int) -> None:
        """Move everything to where it is at a frame."""
        k = int(self.board.samples[frame])
        t, motion = self.recording.t, self.motion
        contact = bool(motion.contact[k])
        self.body.place(float(motion.x_m[k]), float(motion.face[k]), self.clearance, contact)
        self.arm.set_data(*scene.arm_points(motion, k))
        self.path.set_data(*motion.tip[: k + 1].T)
        for values, strip, head in zip(self.series, self.strips, self.heads, strict=True):
            strip.set_data(t[: k + 1], values[: k + 1])
            head.set_data(t[k : k + 1], values[k : k + 1])
        plate = 1e3 * (motion.face[k] - motion.x_m[k])
        self.lens_plate.set_data([plate, plate], [-0.7, 0.7])
        self.lens_plate.set_color(ACCENT if contact else "black")
        self.lens_tip.set_data([1e3 * (motion.tip[k, 0] - motion.x_m[k])], [0.0])
        self.clock.set_text(f"$t$ = {t[k]:.4f} s")
        told = "plate touches the probe" if motion.probe_touched[k] else ""
        slow = self.board.slowdown[frame]
        told = told or (f"{slow:.0f} times slower" if slow >= 1.5 else "")
        self.speed.set_text(told)

    def pictures(self) -> Iterator[Image.Image]:
        """One picture for each frame; what does not move is drawn once."""
        self._place(0)
        self.canvas.draw()
        still = self.canvas.copy_from_bbox(self.canvas.figure.bbox)
        for frame in range(len(self.board.samples)):
            self._place(frame)
            self.canvas.restore_region(still)
            for artist in self.moving:
                artist.axes.draw_artist(artist)
            yield Image.fromarray(np.asarray(self.canvas.buffer_rgba())).convert("RGB")


def _write_gif(path: Path, pictures: Iterator[Image.Image]) -> None:
    """Write pictures as one looping file; they share one palette, so that nothing flickers."""
    kept = list(pictures)
    palette = _palette(kept)
    reduced = [p.quantize(palette=palette, dither=Image.Dither.NONE) for p in kept]
    durations = [FRAME_MS] * (len(reduced) - 1) + [HOLD_MS]
    with replacing(path) as partial:
        reduced[0].save(partial, save_all=True, append_images=reduced[1:], duration=durations,
                        loop=0, optimize=False)


def _palette(pictures: list[Image.Image]) -> Image.Image:
    """Colours of the first, the middle and the last picture."""
    chosen = [pictures[0], pictures[len(pictures) // 2], pictures[-1]]
    joined = Image.fromarray(np.vstack([np.asarray(p) for p in chosen]))
    return joined.quantize(COLORS)
