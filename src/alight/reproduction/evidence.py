"""The runs on which the claims are judged."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from alight.control import Gains
from alight.control.transition import ContactTransitionLaw
from alight.scenarios import Scenario, simulate
from alight.simulation import Recording
from alight.studies import variants
from alight.studies.measures import Measures, measure, run_and_measure

Step = Callable[[str], None]
"""Told what is about to run."""


@dataclass(frozen=True)
class Evidence:
    """Figures of both experiments and of the variants that the claims need."""

    experiment_1: Measures
    experiment_2: Measures
    unsaturated_42: Measures
    clipped_42: tuple[float, Measures] | None
    frictionless_1: Measures
    repeated_1: list[Measures]
    """Experiment 1 under other sensor noise."""
    repeated_2: list[Measures]
    """Experiment 2 under other sensor noise."""
    motor_limit: tuple[float, float]
    artificial_limit: tuple[float, float]
    gains_1: Gains
    K_I: float


@dataclass(frozen=True)
class Runs:
    """The recordings that are kept: both experiments, whole."""

    scenario_1: Scenario
    recording_1: Recording
    scenario_2: Scenario
    recording_2: Recording


REPEATS = 8
"""Runs of each experiment under other sensor noise."""
STEPS = 6
"""Number of steps that `gather` reports."""


def gather(step: Step) -> tuple[Runs, Evidence]:
    """Run both experiments and the variants."""
    one, two = variants.experiment_1(), variants.experiment_2()
    step("Experiment 1, law (32)")
    first = simulate(one)
    step("Experiment 2, law (44)")
    second = simulate(two)
    step("law (44) with the gains (42)")
    unsaturated = run_and_measure(variants.unsaturated_with_42())
    step("the same, clipped until the impact is acceptable")
    clipped = variants.clipped_with_42()
    step("Experiment 1 without tip friction")
    smooth = run_and_measure(variants.without_friction("experiment-1"))
    step("both experiments under other sensor noise")
    repeated = [
        [run_and_measure(scenario, scenario.document.seed + k) for k in range(1, 1 + REPEATS)]
        for scenario in (one, two)
    ]
    motors = two.testbed.motors
    law = one.law
    assert isinstance(law, ContactTransitionLaw)  # the shipped scenario states it
    evidence = Evidence(
        experiment_1=measure(first, one),
        experiment_2=measure(second, two),
        unsaturated_42=unsaturated,
        clipped_42=clipped,
        frictionless_1=smooth,
        repeated_1=repeated[0],
        repeated_2=repeated[1],
        motor_limit=one.testbed.motors.limit,
        artificial_limit=motors.artificial_limit or motors.limit,
        gains_1=law.gains,
        K_I=one.plant.contact.K_I,
    )
    return Runs(one, first, two, second), evidence
