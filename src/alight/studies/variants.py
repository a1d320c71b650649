"""The runs that the paper reports, and those that its claims imply."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from alight.scenarios import Scenario, load_scenario
from alight.studies.measures import Measures, run_and_measure

LIMIT_STEPS = 7
"""Halvings that locate the torque limit at which the impact becomes acceptable."""


def experiment_1(values: Mapping[str, Any] | None = None) -> Scenario:
    """Experiment 1: law (32), gains (42)."""
    return load_scenario("experiment-1", values or {})


def experiment_2(values: Mapping[str, Any] | None = None) -> Scenario:
    """Experiment 2: law (44) with its own gains, torques artificially limited."""
    return load_scenario("experiment-2", values or {})


def unsaturated_with_42(values: Mapping[str, Any] | None = None) -> Scenario:
    """Law (44) with the gains (42), limited by the motors alone (Section V-B)."""
    return load_scenario("experiment-1", {**(values or {}), "law.type": "unsaturated"})


def without_friction(scenario: str, values: Mapping[str, Any] | None = None) -> Scenario:
    """An experiment with the tip friction off."""
    return load_scenario(scenario, {**(values or {}), "plant.tip_friction.mu": 0.0})


def clipped_with_42(
    values: Mapping[str, Any] | None = None,
) -> tuple[float, Measures] | None:
    """Law (44) with the gains (42), clipped until the impact is acceptable (Section V-B).

    Both motor limits are scaled by one factor; the largest factor, to 1 %, at which the plate
    does not touch the probe is returned with the figures of its run. None if even the smallest
    factor tried leaves the impact too hard.
    """
    base = unsaturated_with_42(values)
    limit = base.testbed.motors.limit

    def clipped(share: float) -> Measures:
        bound = [share * limit[0], share * limit[1]]
        setting = {**(values or {}), "testbed.motors.artificial_limit": bound}
        return run_and_measure(unsaturated_with_42(setting))

    low, high, kept = 0.0, 1.0, None
    for _ in range(LIMIT_STEPS):
        share = (low + high) / 2
        figures = clipped(share)
        if figures.clearance > 0:
            low, kept = share, (share, figures)
        else:
            high = share
    return kept
