"""The strike as a moving picture."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from alight.errors import AlightError
from alight.figures import scene
from alight.figures.files import write_gif
from alight.figures.storyboard import FRAME_MS, Storyboard, storyboard
from alight.figures.style import ACCENT, FAINT, figure_of, new_figure, prepare, set_range, styled
from alight.scenarios.scenario import Scenario
from alight.simulation.recording import Recording

HOLD_MS = 2000
"""Time for which the last frame is shown."""
_TIP_MARKER = [(0.0, 0.0), (-1.0, 0.6), (-1.0, -0.6)]


@styled
def animate(
    recording: Recording,
    scenario: Scenario,
    path: str | Path,
    frames: int = 160,
    until: float | None = None,
    fig: Figure | None = None,
) -> Figure:
    """Write the strike as a GIF: arm and body in plan, force, compression, the contact magnified.

    The first impact runs in slow motion. As in `plan_view`, what lies behind the struck face is
    schematic.

    Parameters
    ----------
    recording : Recording
        A run of the scenario.
    scenario : Scenario
        Whose arm, body and target are drawn.
    path : str or Path
        A file with the suffix gif; its folder must exist.
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
    shown_on = figure.canvas
    film = _Film(figure, recording, scenario, board)
    try:
        write_gif(path, film.pictures(), FRAME_MS, HOLD_MS)
    finally:
        film.stop()
        figure.set_canvas(shown_on)
    return figure


class _Film:
    """The figure of an animation and everything in it that moves."""

    def __init__(
        self, fig: Figure, recording: Recording, scenario: Scenario, board: Storyboard
    ) -> None:
        self.recording, self.scenario, self.board = recording, scenario, board
        self.motion = scene.motion_of(recording, scenario)
        self.clearance = scenario.testbed.probe.clearance
        self.shown = slice(0, int(board.samples[-1]) + 1)
        self.canvas = FigureCanvasAgg(fig)
        grid = fig.add_gridspec(3, 2, width_ratios=[1.7, 1], height_ratios=[1.1, 1.1, 1])
        self._set_plan(fig.add_subplot(grid[:, 0]))
        self._set_strips(fig.add_subplot(grid[0, 1]), fig.add_subplot(grid[1, 1]))
        self._set_lens(fig.add_subplot(grid[2, 1]))
        # What moves, the lowest first; the target is among it to lie on top of the body.
        self.moving = [
            *self.body.artists,
            self.path,
            *self.target,
            self.arm,
            self.clock,
            self.remark,
            *self.strips,
            *self.heads,
            self.plate,
            self.tip,
        ]
        for artist in self.moving:
            artist.set_animated(True)

    def _set_plan(self, ax: Axes) -> None:
        prepare(ax)
        span = scene.plate_span(self.motion, self.scenario.target.x_rd2)
        self.body = scene.Body(ax, span, scene.wall_of(self.scenario))
        scene.frame_scene(ax, self.motion, self.board.samples, self.body)
        self.target = scene.draw_target(ax, self.scenario, self.body)
        scene.draw_base(ax)
        (self.path,) = ax.plot([], [], color="0.4", linewidth=0.8)
        (self.arm,) = ax.plot(
            [], [], "o-", color="black", linewidth=3.0, markersize=5, markerfacecolor="white"
        )
        self.clock = ax.set_title(" ", loc="left", fontsize=11)
        self.remark = ax.set_title(" ", loc="right", fontsize=10)

    def _set_strips(self, force: Axes, compression: Axes) -> None:
        x_0 = self.scenario.plant.body.x_0
        goal = 1e3 * (self.scenario.target.x_md - x_0)
        self.series = (self.recording["F_m"], 1e3 * (self.recording["x_m"] - x_0))
        labels = ("impact force $F_m$ [N]", "compression $x_m - x_0$ [mm]")
        self.strips, self.heads = [], []
        for ax, values, label, level in zip(
            (force, compression), self.series, labels, (0.0, goal), strict=True
        ):
            prepare(ax).set_title(label, loc="left")
            ax.set_xlim(0.0, 1.02 * self.recording.t[self.shown][-1])
            set_range(ax, [values[self.shown], np.array([level])])
            self.strips += ax.plot([], [], color="black", linewidth=0.9)
            self.heads += ax.plot([], [], "o", color=ACCENT, markersize=4)
        compression.axhline(goal, color=ACCENT, linewidth=0.9, linestyle="--")
        compression.set_xlabel("time [s]")

    def _set_lens(self, ax: Axes) -> None:
        """Draw the contact in millimetres, seen from the body: tip, plate and probe."""
        prepare(ax).set_title("seen from the body, magnified [mm]", loc="left")
        probe = 1e3 * self.clearance
        deflection = 1e3 * (self.motion.face - self.motion.x_m)[self.shown]
        reach = 1.6 * max(probe, *deflection[np.isfinite(deflection)])
        ax.set_xlim(-1.2 * reach, reach)
        ax.set_ylim(-1.0, 1.0)
        ax.set_yticks([])
        ax.axvline(0.0, **FAINT)
        ax.axvspan(probe, reach, color="0.4", linewidth=0)
        ax.annotate(
            "probe",
            (probe, -0.8),
            xytext=(4, 0),
            textcoords="offset points",
            color="white",
            fontsize=8,
        )
        (self.plate,) = ax.plot([], [], linewidth=2.0, solid_capstyle="butt")
        (self.tip,) = ax.plot([], [], marker=_TIP_MARKER, color="black", markersize=20)

    def _place(self, frame: int) -> None:
        """Move everything to where it is at a frame."""
        k = int(self.board.samples[frame])
        t, motion = self.recording.t, self.motion
        x_m, face, contact = float(motion.x_m[k]), float(motion.face[k]), bool(motion.contact[k])
        self.body.place(x_m, face, self.clearance, contact)
        self.arm.set_data(*scene.arm_points(motion, k))
        self.path.set_data(*motion.tip[: k + 1].T)
        for values, strip, head in zip(self.series, self.strips, self.heads, strict=True):
            strip.set_data(t[: k + 1], values[: k + 1])
            head.set_data(t[k : k + 1], values[k : k + 1])
        self.plate.set_data([1e3 * (face - x_m)] * 2, [-0.7, 0.7])
        self.plate.set_color(ACCENT if contact else "black")
        self.tip.set_data([1e3 * (motion.tip[k, 0] - x_m)], [0.0])
        self.clock.set_text(f"$t$ = {t[k]:.4f} s")
        self.remark.set_text(self._remark(frame, k))

    def _remark(self, frame: int, k: int) -> str:
        if self.motion.probe_touched[k]:
            return "plate touches the probe"
        slowdown = self.board.slowdown[frame]
        return f"{slowdown:.0f} times slower" if slowdown >= 1.5 else ""

    def pictures(self) -> Iterator[Image.Image]:
        """Draw one picture for each frame; what does not move is drawn once."""
        self._place(0)
        self.canvas.draw()
        still: Any = self.canvas.copy_from_bbox(self.canvas.figure.bbox)
        for frame in range(len(self.board.samples)):
            self._place(frame)
            self.canvas.restore_region(still)
            for artist in self.moving:
                artist.axes.draw_artist(artist)
            yield Image.fromarray(np.asarray(self.canvas.buffer_rgba())).convert("RGB")

    def stop(self) -> None:
        """Make what moved part of the figure, which then stands still."""
        for artist in self.moving:
            artist.set_animated(False)
