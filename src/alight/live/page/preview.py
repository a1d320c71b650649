"""What a draft of the law does to the certificate: before it is applied, without a simulation."""

from __future__ import annotations

import dataclasses
import threading
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from alight.control import AdaptiveContactLaw, AdaptiveState, Law
from alight.errors import AlightError
from alight.scenarios import Scenario
from alight.tables import number
from alight.theory.case import Case, case_of
from alight.theory.lyapunov import ideal_measurement
from alight.theory.newtons import (
    feedback_limit,
    feedback_within,
    final_forces,
    joint_limit_of_all_poses,
)
from alight.theory.proven import (
    first_contact_of,
    mass_bounds,
    mass_obstacle,
    propositions,
    robot_bounds,
)
from alight.theory.proven.robot_part import RobotBounds
from alight.theory.sampled import linear_loops, spectrum

CONDITIONS = ("LOC", "LOC, adapting", "VTX", "filter")


@dataclass(frozen=True)
class Line:
    """One line of the certificate: a condition, or a bound."""

    name: str
    told: str
    """Its value in a few characters."""
    unit: str
    holds: bool | None
    """Whether it is as one would have it; None where that is no question, or undefined."""
    meaning: str
    """For who wants to know more."""


@dataclass(frozen=True)
class Effect:
    """The certificate of a law in short, or why there is none."""

    lines: tuple[Line, ...] = ()
    problem: str = ""

    @property
    def certified(self) -> bool:
        """Whether every condition holds."""
        return not self.problem and all(line.holds is not False for line in self.lines)


class Preview:
    """The certificates of the laws of one scenario, a fifth of a second each; threads take turns.

    What stays the same from one draft to the next is computed once.
    """

    def __init__(self, scenario: Scenario) -> None:
        self._scenario = scenario
        self._cases: dict[Any, Case] = {}
        self._one_at_a_time = threading.Lock()

    def of(self, law: Law) -> Effect:
        """The effect of a law on the certificate."""
        with self._one_at_a_time:
            try:
                return Effect(tuple(_lines(self._case(law), self._scenario)))
            except AlightError as error:
                return Effect(problem=str(error))
            except (ArithmeticError, np.linalg.LinAlgError) as error:
                return Effect(problem=f"cannot be computed for these numbers: {error}")

    def _case(self, law: Law) -> Case:
        # The bounds of the inertia, which cost most, depend on the box of theta_r alone.
        if not isinstance(law, AdaptiveContactLaw):
            raise AlightError(
                f"{type(law).__name__} does not adapt; a certificate needs an adaptive law on the "
                "paper's error system, such as force-limiting or unsaturated"
            )
        key = (law.theta_r.lower, law.theta_r.upper, law.theta_r.margin)
        if key not in self._cases:
            self._cases = {key: case_of(dataclasses.replace(self._scenario, law=law))}
        start = AdaptiveState(**law.initial_state())
        return dataclasses.replace(self._cases[key], law=law, a=start)


def _lines(case: Case, scenario: Scenario) -> Iterator[Line]:
    robot = robot_bounds(case)
    yield from _conditions(case)
    yield from _sampled(case, scenario)
    yield _first_contact(case, robot)
    yield from _feedback(case, scenario, robot)
    yield _first_torque(case, scenario)
    yield _final_force(case)
    yield _lasting_contact(case)


def _conditions(case: Case) -> Iterator[Line]:
    found = {made.number: made for made in propositions(case)}
    for name in CONDITIONS:
        made = found[name]
        sides = f"{number(made.left)} {made.relation} {number(made.right)} {made.unit}"
        yield Line(
            name,
            "undefined" if made.undefined else _signed(made.margin),
            made.unit,
            made.holds,
            f"Margin of {made.statement}: {made.undefined or sides}. {made.meaning}",
        )


def _signed(value: float | None) -> str:
    return number(value) if value is None or value < 0 else f"+{number(value)}"


def _sampled(case: Case, scenario: Scenario) -> Iterator[Line]:
    """Worst of the plants, per phase."""
    bed = scenario.testbed
    radii: dict[str, list[float | str]] = {}
    for phase, _, linear in linear_loops(case, scenario):
        found = (
            linear
            if isinstance(linear, str)
            else spectrum(linear, 1 / bed.sample_rate, bed.delay).radius
        )
        radii.setdefault(phase, []).append(found)
    for which, values in radii.items():
        name = f"sampled, {which.removesuffix(' motion')}"
        meaning = (
            f"Spectral radius over one sample at {bed.sample_rate:g} Hz, linearised at rest at the "
            "true parameters; the larger of the plants without losses and with them."
        )
        missing = [value for value in values if isinstance(value, str)]
        if missing:
            yield Line(name, "no rest", "", None, missing[0])
        else:
            worst = max(value for value in values if not isinstance(value, str))
            yield Line(name, f"{worst:.5f}", "", worst < 1, meaning)


def _first_contact(case: Case, robot: RobotBounds) -> Line:
    found = first_contact_of(case.law, case.s, case.a, robot)
    told = "not proven" if found.latest is None else f"≤ {number(found.latest)}"
    return Line(
        "first contact",
        told,
        "s",
        found.latest is not None,
        found.undefined or "Contact comes no later on the lossless model (Proposition C).",
    )


def _feedback(case: Case, scenario: Scenario, robot: RobotBounds) -> Iterator[Line]:
    limit = feedback_limit(case.law)
    basis = "whatever the errors"
    if limit is None:
        limit = feedback_within(case.law, np.array(robot.e_r), np.array(robot.r_r))
        basis = "for the errors that Proposition A admits; it grows with them"
    yield Line(
        "feedback force",
        f"≤ {_pair(limit)}",
        "N",
        None,
        f"Largest share of the feedback in the tip force per axis, {basis}.",
    )
    torque, motors = joint_limit_of_all_poses(case.law.model.arm, limit), _motors(scenario)
    yield Line(
        "feedback torque",
        f"≤ {_pair(torque)}",
        "N m",
        bool((torque < motors).all()),
        f"Its share in the joint torques in every pose; the motors give {_pair(motors)} N m.",
    )


def _first_torque(case: Case, scenario: Scenario) -> Line:
    tau, motors = (
        np.asarray(case.law.flow(case.a._asdict(), ideal_measurement(case.s)).tau),
        _motors(scenario),
    )
    return Line(
        "first torque",
        _pair(tau),
        "N m",
        bool((np.abs(tau) <= motors).all()),
        f"What the law computes at the start of a run; the motors give {_pair(motors)} N m.",
    )


def _final_force(case: Case) -> Line:
    low, high = sorted(final_forces(case))
    return Line(
        "final force",
        f"{number(low)}…{number(high)}",
        "N",
        None,
        "What holds the mass at its set point, for every spring of the assumptions.",
    )


def _lasting_contact(case: Case) -> Line:
    bounds = mass_bounds(case)
    force = None if bounds is None else bounds.F_m
    told = "not bounded" if force is None else f"≤ {number(force)}"
    why = mass_obstacle(case) or "the filter may come closer to 1 than numbers can tell"
    meaning = "Contact force while contact is kept, on the lossless model (Proposition B)"
    return Line(
        "lasting contact", told, "N", force is not None, f"{meaning}{'' if force else ': ' + why}."
    )


def _motors(scenario: Scenario) -> np.ndarray:
    return np.asarray(scenario.testbed.motors.clip(np.full(2, np.inf)))


def _pair(values: np.ndarray) -> str:
    return ", ".join(number(float(value)) for value in values)
