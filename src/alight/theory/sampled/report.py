"""What sampling does to a scenario: eigenvalues, sample times, adaptation steps."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from alight.scenarios import Scenario
from alight.simulation.recording import Recording
from alight.tables import Table
from alight.testbed import Testbed
from alight.theory.case import Case
from alight.theory.condition import Condition, Constant
from alight.theory.sampled.adaptation import AdaptationSteps, adaptation_steps
from alight.theory.sampled.loops import AtRate, SampledLoop, sampled_loops
from alight.theory.sampled.wording import adaptation_table, loops_table, told


@dataclass(frozen=True)
class Sampled:
    """Part of a certificate: what sampling does, which no theorem of the paper covers."""

    T: float
    """Sample time of the scenario [s]."""
    loops: tuple[SampledLoop, ...]
    """Two phases of two plants, without the delay and with it."""
    adaptation: AdaptationSteps
    conditions: tuple[Condition, ...]
    constants: tuple[Constant, ...]

    @property
    def stable(self) -> bool:
        """Whether the loop decays locally in both phases, without losses and with them."""
        return all(loop.stable for loop in self.loops if loop.present)

    @property
    def told(self) -> str:
        """The finding in a sentence or two."""
        return told(self.T, self.loops, self.adaptation)

    def tables(self) -> tuple[Table, ...]:
        """Loops, and adaptation in one sample."""
        return loops_table(self.T, self.loops), adaptation_table(self.adaptation, self.constants)

    def as_dict(self) -> dict[str, Any]:
        """Plain data in SI units; an eigenvalue is a pair of real and imaginary part."""
        steps = {name: _plain(value) for name, value in vars(self.adaptation).items()}
        return {
            "T": self.T,
            "stable": self.stable,
            "loops": [_loop(loop) for loop in self.loops],
            "adaptation": steps,
            "conditions": [
                {**dataclasses.asdict(c), "margin": c.margin, "holds": c.holds}
                for c in self.conditions
            ],
            "constants": [dataclasses.asdict(c) for c in self.constants],
        }


def sampled(case: Case, scenario: Scenario, recording: Recording) -> Sampled:
    """Judge the sampled loop of a scenario.

    The eigenvalues are those of the loop linearised at rest, at the true parameters, with ideal
    sensors and without tip friction, whose sticking is not smooth. They depend on where the
    estimates stand, also along the directions that nothing excites: where the estimates of a run
    come to rest elsewhere, or bounce between their bounds, its loop is another one.

    Parameters
    ----------
    case : Case
        Of the scenario.
    scenario : Scenario
        Its plant, testbed, and the elbow of its start.
    recording : Recording
        Of the scenario, with the measured signals and the law's state.
    """
    T = 1 / scenario.testbed.sample_rate
    loops = tuple(sampled_loops(case, scenario))
    steps = adaptation_steps(case.law, recording, T)
    present = [loop for loop in loops if loop.present]
    conditions = (*map(_inside, present), *_adapting(steps))
    constants = (*map(_least_rate, present), *_rounding(scenario.testbed))
    return Sampled(T, loops, steps, conditions, constants)


def _inside(loop: SampledLoop) -> Condition:
    return Condition(
        number=f"sampled, {loop.phase}",
        statement=f"spectral radius < 1, plant {loop.plant}",
        left=None if loop.adapting is None else loop.adapting.now.radius,
        relation="<",
        right=1.0,
        unit="",
        meaning=f"At its sample rate the loop decays to its rest in {loop.phase}, linearised at "
        "the true parameters with ideal sensors and without tip friction.",
        undefined=loop.undefined,
    )


def _least_rate(loop: SampledLoop) -> Constant:
    found = loop.adapting
    return Constant(
        symbol="1/T",
        number=f"sampled, {loop.phase}",
        value=None if found is None else found.least_rate,
        unit="Hz",
        meaning="Sample rate from which on the linearised loop decays, plant " + loop.plant + ".",
        undefined=loop.undefined if found is None else found.undefined,
    )


def _adapting(steps: AdaptationSteps) -> Iterator[Condition]:
    """The tolerance of the projection, worst of each estimated vector, and the monitor of V_r."""
    for name in ("theta_dk_hat", "theta_r_hat"):
        chosen = [i for i, column in enumerate(steps.columns) if column.startswith(name)]
        worst = chosen[int(steps.ratio[chosen].argmax())]
        yield Condition(
            number="sampled, projection",
            statement=f"T |mu| / (epsilon / (n + 1)) <= 1 for {steps.columns[worst]}",
            left=float(steps.ratio[worst]),
            relation="<=",
            right=1.0,
            unit="",
            meaning="Along the run the Euler step of the estimate stays within the bounds that "
            "the projection keeps in continuous time; beyond, the clip keeps it.",
        )
    yield Condition(
        number="sampled, V_r",
        statement="share of samples with T |Gamma_r^(1/2) Y_r^T r_r|^2 > 2 dissipation",
        left=steps.outrun,
        relation="<=",
        right=0.0,
        unit="",
        meaning="Along the run no Euler step of theta_r_hat adds to V_r more than the feedback "
        "takes from it in continuous time.",
    )


def _rounding(bed: Testbed) -> Iterator[Constant]:
    """What the linearisation leaves out of the sensors: a bounded disturbance."""
    angle = 2 * np.pi / bed.encoder.counts if bed.encoder.counts else 0.0
    for symbol, step, unit, sensor in (
        ("q_dot", angle, "rad/s", "encoder"),
        ("x_m_dot", bed.transducer.resolution, "m/s", "transducer"),
    ):
        yield Constant(
            symbol=f"step of {symbol}",
            number="sampled, sensors",
            value=float(step * bed.sample_rate),
            unit=unit,
            meaning=f"One step of the {sensor} over a sample: what the backward difference makes "
            "of rounding, a bounded disturbance that no eigenvalue shows.",
        )


def _loop(loop: SampledLoop) -> dict[str, Any]:
    return {
        "phase": loop.phase,
        "plant": loop.plant,
        "delay": loop.delay,
        "present": loop.present,
        "stable": loop.stable,
        "undefined": loop.undefined,
        "adapting": _at_rate(loop.adapting),
        "theta_r_hat_held": _at_rate(loop.held),
    }


def _at_rate(found: AtRate | None) -> dict[str, Any] | None:
    if found is None:
        return None
    damping, frequency = found.now.least_damped
    return {
        "eigenvalues": _plain(found.now.judged),
        "free_mass": _plain(found.now.free_mass),
        "unexcited": found.now.unexcited,
        "spectral_radius": found.now.radius,
        "least_damping": damping,
        "its_frequency": frequency,
        "largest_sample_time": found.largest,
        "undefined": found.undefined,
    }


def _plain(value: Any) -> Any:
    """Arrays as lists, complex numbers as pairs."""
    if isinstance(value, np.ndarray) and np.iscomplexobj(value):
        return [[float(z.real), float(z.imag)] for z in value]
    return value.tolist() if isinstance(value, np.ndarray) else value
