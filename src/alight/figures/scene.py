"""Arm and body in plan: where they are at each sample, and how they are drawn."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from alight.figures.style import ACCENT
from alight.scenarios.scenario import Scenario
from alight.simulation.recording import Recording

# Only the face of the body is to scale: what lies behind it is not part of the model. [m]
PLATE, STANDOFF, DEPTH, SPRING = 0.006, 0.016, 0.055, 0.13


class Motion(NamedTuple):
    """Positions in the plane of motion [m], one row for each sample."""

    elbow: np.ndarray
    tip: np.ndarray
    x_m: np.ndarray
    face: np.ndarray
    """The struck face along X1: it gives way to the tip by the deflection of the stiff spring."""
    contact: np.ndarray
    """Whether the tip touches the body."""
    probe_touched: np.ndarray
    """Whether the plate touches the capacitance probe."""


def motion_of(recording: Recording, scenario: Scenario) -> Motion:
    """Where arm and body are at each sample of a recording."""
    plant = scenario.plant
    return Motion(
        elbow=plant.arm.elbow(recording["q"].T).T,
        tip=recording["x_r"],
        x_m=recording["x_m"],
        face=recording["x_m"] + plant.contact.penetration(recording["gap"]),
        contact=recording["Lambda"] > 0,
        probe_touched=recording["probe_clearance"] <= 0,
    )


def arm_points(motion: Motion, sample: int) -> tuple[np.ndarray, np.ndarray]:
    """Base, elbow and tip at a sample: their X1 and their X2, shape (3,) each."""
    points = np.array([[0.0, 0.0], motion.elbow[sample], motion.tip[sample]])
    return points[:, 0], points[:, 1]


def plate_span(motion: Motion, x_rd2: float) -> tuple[float, float]:
    """Extent of the body along X2 [m]: it holds what is touched near the target."""
    touched = np.clip(motion.tip[motion.contact, 1], x_rd2 - 0.15, x_rd2 + 0.15)
    held = np.append(touched, [x_rd2 - 0.04, x_rd2 + 0.04])
    return float(held.min()) - 0.015, float(held.max()) + 0.015


def zigzag(start: float, end: float, at: float, coils: int, width: float) -> np.ndarray:
    """Corners of a spring along X1 at the height ``at``, shape (n, 2)."""
    lead = 0.12 * (end - start)
    x1 = np.concatenate([[start], np.linspace(start + lead, end - lead, 2 * coils + 1), [end]])
    x2 = at + width * np.array([0.0, 0.0, *([1.0, -1.0] * coils)[:-1], 0.0, 0.0])
    return np.column_stack([x1, x2])


class Body:
    """The struck body: plate on its stiff spring, probe, mass, and the spring to the wall."""

    def __init__(self, ax: Axes, span: tuple[float, float], wall: float) -> None:
        self.low, self.high = span
        self.middle, self.height = sum(span) / 2, span[1] - span[0]
        self.wall = wall
        line: dict[str, Any] = {"color": "black", "linewidth": 0.8, "solid_joinstyle": "round"}
        edge: dict[str, Any] = {"edgecolor": "black", "linewidth": 0.8, "zorder": 2.5}
        self.plate = Rectangle((0, self.low), PLATE, self.height, facecolor="white", **edge)
        self.mass = Rectangle((0, self.low), DEPTH, self.height, facecolor="0.85", **edge)
        self.probe = Rectangle((0, self.middle - 0.008), 0.0, 0.016, facecolor="0.4", **edge)
        for patch in (self.plate, self.mass, self.probe):
            ax.add_patch(patch)
        self.name = ax.text(
            0, self.middle, "body", rotation=90, ha="center", va="center", zorder=3, clip_on=True
        )
        self.stiff = [ax.plot([], [], **line)[0] for _ in range(2)]
        self.spring = ax.plot([], [], **line)[0]
        ax.plot([wall, wall], span, color="black", linewidth=2.5, solid_capstyle="butt")

    @property
    def artists(self) -> list[Any]:
        """Everything that moves."""
        return [self.spring, *self.stiff, self.mass, self.name, self.probe, self.plate]

    def place(self, x_m: float, face: float, clearance: float, contact: bool) -> None:
        """Move the body to ``x_m`` and its face to ``face`` [m]; the face shows contact."""
        front = x_m + PLATE + STANDOFF
        self.plate.set_x(face)
        self.plate.set_facecolor(ACCENT if contact else "white")
        self.mass.set_x(front)
        self.name.set_x(front + DEPTH / 2)
        self.probe.set_x(x_m + PLATE + clearance)
        self.probe.set_width(STANDOFF - clearance)
        for line, at in zip(self.stiff, (0.2, 0.8), strict=True):
            height = self.low + at * self.height
            line.set_data(*zigzag(face + PLATE, front, height, 3, 0.006).T)
        self.spring.set_data(*zigzag(front + DEPTH, self.wall, self.middle, 6, 0.012).T)


def draw_base(ax: Axes) -> None:
    """The base motor at the origin."""
    ax.plot(0.0, 0.0, "o", color="black", markerfacecolor="0.85", markersize=13, zorder=2.6)
    ax.plot(0.0, 0.0, ".", color="black", markersize=3, zorder=2.7)


def draw_target(ax: Axes, scenario: Scenario, body: Body) -> list[Any]:
    """Where the face, and where the tip on it, shall come to rest."""
    target = scenario.target
    face = ax.plot(
        [target.x_md] * 2,
        [body.low, body.high],
        color=ACCENT,
        linewidth=0.9,
        linestyle="--",
        label="$x_{md}$, set point",
        zorder=3.5,
    )
    style: dict[str, Any] = {"color": ACCENT, "markersize": 9, "linestyle": "none"}
    tip = ax.plot(target.x_md, target.x_rd2, marker="+", label="target", zorder=5, **style)
    return [*face, *tip]


def frame_scene(ax: Axes, motion: Motion, samples: np.ndarray, body: Body) -> None:
    """Set limits that hold the arm at the given samples and the body, at equal scales."""
    points = np.vstack([motion.elbow[samples], motion.tip[samples], [[0.0, 0.0]]])
    low = np.minimum(points.min(axis=0), [0.0, body.low])
    high = np.maximum(points.max(axis=0), [body.wall, body.high])
    ax.set_aspect("equal")
    ax.set_xlim(low[0] - 0.03, high[0] + 0.015)
    ax.set_ylim(low[1] - 0.03, high[1] + 0.025)
    ax.set_xlabel("$X_1$ [m]")
    ax.set_ylabel("$X_2$ [m]")


def wall_of(scenario: Scenario) -> float:
    """Place of the wall behind the spring [m]; schematic."""
    return scenario.plant.body.x_0 + PLATE + STANDOFF + DEPTH + SPRING
