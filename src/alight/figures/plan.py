"""The strike seen from above."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from alight.errors import AlightError
from alight.figures import scene
from alight.figures.style import ACCENT, FAINT, PAGE, figure_of, new_figure, prepare, styled
from alight.figures.traces import ended, first_contact
from alight.scenarios.scenario import Scenario
from alight.simulation.recording import Recording

APPROACH = 4
"""Poses that are drawn before the first contact."""


@styled
def plan_view(
    recording: Recording,
    scenario: Scenario,
    instants: Sequence[float] | None = None,
    ax: Axes | None = None,
) -> Figure:
    """Draw the strike in plan [m], at equal scales: arm, tip path, body, target, first contact.

    The arm is drawn at several instants, the later the darker, and the body at the last of them.
    The struck face is to scale; plate, probe and springs behind it are schematic.

    Parameters
    ----------
    recording : Recording
        A run of the scenario.
    scenario : Scenario
        Whose arm, body and target are drawn.
    instants : sequence of float, optional
        Times [s] at which the arm is drawn; by default evenly spaced along the path of the tip
        up to the first contact, then the contact and the end.
    ax : Axes, optional
        Where to draw; a new figure if absent.

    Returns
    -------
    Figure

    Raises
    ------
    AlightError
        If an instant is not within the recording.
    """
    own = ax is None
    ax = prepare(new_figure(None, PAGE, PAGE).subplots() if ax is None else ax)
    motion = scene.motion_of(recording, scenario)
    touch = first_contact(recording)
    samples = _default_poses(motion, touch) if instants is None else _at(recording, instants)
    last = int(samples[-1])

    body = scene.Body(ax, scene.plate_span(motion, scenario.target.x_rd2), scene.wall_of(scenario))
    body.place(
        float(motion.x_m[last]),
        float(motion.face[last]),
        scenario.testbed.probe.clearance,
        contact=False,
    )
    scene.frame_scene(ax, motion, samples, body)
    ax.plot([scenario.plant.body.x_0] * 2, [body.low, body.high], **FAINT, label="$x_0$, at rest")
    scene.draw_target(ax, scenario, body)
    ax.plot(
        *motion.tip[: last + 1].T, color="black", linewidth=0.8, zorder=2.8, label="path of the tip"
    )
    _draw_poses(ax, recording, motion, samples)
    if touch is not None and touch <= last:
        label = f"first contact, {recording.t[touch]:.4f} s"
        ax.plot(*motion.tip[touch], "o", color=ACCENT, markersize=5, zorder=4, label=label)
    if not recording.verdict.completed and last == len(recording) - 1:
        ax.set_title(ended(recording.verdict), loc="right", fontsize=8)
    ax.legend(loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0)
    if own:
        # The axes take about 0.7 of the width; an equal aspect then sets the height.
        wide, high = np.ptp(ax.get_xlim()), np.ptp(ax.get_ylim())
        figure_of(ax).set_size_inches(PAGE, 0.7 * PAGE * high / wide + 0.55)
    return figure_of(ax)


def _default_poses(motion: scene.Motion, touch: int | None) -> np.ndarray:
    """Samples evenly spaced along the path of the tip up to the contact, the contact, the end."""
    end = len(motion.tip) - 1
    until = end if touch is None else touch
    steps = np.linalg.norm(np.diff(motion.tip[: until + 1], axis=0), axis=1)
    travelled = np.concatenate([[0.0], np.cumsum(steps)])
    marks = np.linspace(0.0, travelled[-1], APPROACH + 1)
    poses = np.minimum(np.searchsorted(travelled, marks), until)
    return np.unique([*poses, until, end])


def _at(recording: Recording, instants: Sequence[float]) -> np.ndarray:
    """Samples nearest to the given times."""
    t = recording.t
    for instant in instants:
        if not t[0] <= instant <= t[-1]:
            raise AlightError(
                f"instants: {instant} s is not within the recording, {t[0]:g} to {t[-1]:g} s"
            )
    if not instants:
        raise AlightError("instants: give at least one time")
    return np.unique([int(np.argmin(np.abs(t - instant))) for instant in instants])


def _draw_poses(ax: Axes, recording: Recording, motion: scene.Motion, samples: np.ndarray) -> None:
    """The arm at each sample, fading in."""
    for shade, sample in zip(np.linspace(0.8, 0.0, len(samples)), samples, strict=True):
        ax.plot(
            *scene.arm_points(motion, int(sample)),
            "o-",
            color=str(shade),
            linewidth=2.2,
            markersize=4.5,
            markerfacecolor="white",
            markeredgewidth=1.0,
            zorder=3,
            label=f"$t$ = {recording.t[sample]:.4f} s",
        )
    scene.draw_base(ax)
