"""The run beside which the bounds of its scenario stand."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np

from alight.errors import AlightError
from alight.scenarios import Scenario
from alight.simulation import Recording
from alight.theory.case import Case
from alight.theory.newtons.feedback import feedback_limit, feedback_within
from alight.theory.newtons.observe import observe
from alight.theory.proven.robot_part import RobotBounds, robot_bounds


@dataclass(frozen=True)
class Shown:
    """A case, a run of its scenario, and what is made of both once."""

    case: Case
    scenario: Scenario
    recording: Recording
    seen: dict[str, np.ndarray]
    """What `observe` evaluates along the run, on the plant that was simulated."""
    robot: RobotBounds
    """Proposition A over the boxes."""

    @property
    def contact(self) -> np.ndarray:
        """Numbers of the samples from the first touch to the first separation; may be empty."""
        touching = self.recording["gap"] >= 0
        if not touching.any():
            return np.arange(0)
        first = int(np.argmax(touching))
        apart = ~touching[first:]
        last = first + int(np.argmax(apart)) if apart.any() else len(touching)
        return np.arange(first, last)

    @property
    def motor_limit(self) -> np.ndarray:
        """Largest torque that reaches each joint [N m]."""
        return np.asarray(self.scenario.testbed.motors.clip(np.full(2, np.inf)))

    @property
    def limit(self) -> np.ndarray | None:
        """Largest feedback force per axis [N], whatever the errors; None if they decide."""
        return feedback_limit(self.case.law)

    @property
    def limit_of_A(self) -> np.ndarray:
        """Largest feedback force per axis [N] for the errors that Proposition A admits."""
        return feedback_within(self.case.law, np.array(self.robot.e_r), np.array(self.robot.r_r))


def shown(case: Case, scenario: Scenario, recording: Recording) -> Shown:
    """Evaluate a run of the case's scenario.

    Raises
    ------
    AlightError
        If samples are missing from the recording: work and peaks would be wrong.
    UnknownName
        If signals are missing from it.
    """
    dt = scenario.closed_loop.dt
    if len(recording) < 2 or not np.allclose(np.diff(recording.t), dt, rtol=1e-3, atol=0):
        raise AlightError(
            f"bounds in newtons need a recording of every sample of {scenario.name}, two of them "
            "at least; record with every = 1"
        )
    finite = np.isfinite(recording.samples).all(axis=1)
    recording = dataclasses.replace(
        recording, t=recording.t[finite], samples=recording.samples[finite]
    )
    seen = observe(scenario.plant, case.law, recording)
    return Shown(case, scenario, recording, seen, robot_bounds(case))


def peak(values: np.ndarray) -> float:
    """Largest magnitude."""
    return float(np.abs(values).max())
