"""Each phase of each plant of a scenario, linearised and sampled."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Literal

from alight.errors import AlightError
from alight.models import Plant, TipFriction
from alight.scenarios import Scenario
from alight.theory.case import Case
from alight.theory.sampled.linear import LinearLoop, linear_loop
from alight.theory.sampled.rest import Phase, Rest, rest_in_contact, rest_in_free_motion
from alight.theory.sampled.spectrum import Spectrum, largest_sample_time, spectrum

Losses = Literal["lossless", "with its losses"]


@dataclass(frozen=True)
class AtRate:
    """A loop at one sample time, and as slowly as it may be sampled."""

    now: Spectrum
    """Eigenvalues at the scenario's sample time."""
    largest: float | None
    """Largest sample time from 0 on with all judged eigenvalues inside the unit circle [s]."""
    undefined: str
    """Why there is no largest sample time; empty if there is one."""

    @property
    def least_rate(self) -> float | None:
        """Sample rate from which on the loop decays [Hz]."""
        return None if self.largest is None else 1 / self.largest


@dataclass(frozen=True)
class SampledLoop:
    """One phase of one plant, with the torque delayed by a sample or not."""

    phase: Phase
    plant: Losses
    """Without dissipation, or with that of the scenario but the tip friction."""
    delay: bool
    """Whether each torque is held back by a sample."""
    present: bool
    """Whether the scenario's testbed has it so."""
    adapting: AtRate | None
    """The law as it is; None where the loop has no rest."""
    held: AtRate | None
    """With ``theta_r_hat`` held instead of adapted: what the feedback alone does."""
    undefined: str = ""
    """Why there is no rest; empty if there is one."""

    @property
    def stable(self) -> bool:
        """Whether all judged modes decay at the scenario's sample time."""
        return self.adapting is not None and self.adapting.now.radius < 1


def sampled_loops(case: Case, scenario: Scenario) -> Iterator[SampledLoop]:
    """Contact and free motion, without losses and with them, without the delay and with it."""
    bed = scenario.testbed
    for phase, plant, linear in linear_loops(case, scenario):
        for delay in (False, True):
            which = (phase, plant, delay, delay == bed.delay)
            if isinstance(linear, str):
                yield SampledLoop(*which, None, None, linear)
            else:
                yield SampledLoop(*which, *_both(linear, 1 / bed.sample_rate, delay))


def linear_loops(
    case: Case, scenario: Scenario
) -> Iterator[tuple[Phase, Losses, LinearLoop | str]]:
    """Each phase of each plant, linearised at its rest; why there is none where it has no rest."""
    own = dataclasses.replace(scenario.plant, tip_friction=TipFriction())
    elbow = scenario.document.start.elbow
    plants: tuple[tuple[Losses, Plant], ...] = (("lossless", case.plant), ("with its losses", own))
    rests: tuple[tuple[Phase, Callable[..., Rest]], ...] = (
        ("contact", rest_in_contact),
        ("free motion", rest_in_free_motion),
    )
    for phase, rest in rests:
        for name, plant in plants:
            try:
                yield phase, name, linear_loop(rest(plant, case.law, elbow), scenario.testbed)
            except AlightError as error:
                yield phase, name, str(error)


def _both(linear: LinearLoop, T: float, delay: bool) -> tuple[AtRate, AtRate]:
    """With ``theta_r_hat`` adapting, and with it held; the same where nothing excites it."""
    adapting = _at_rate(linear, T, delay)
    excited = linear.basis.shape[1] > 0
    return adapting, _at_rate(linear.with_theta_r_held(), T, delay) if excited else adapting


def _at_rate(loop: LinearLoop, T: float, delay: bool) -> AtRate:
    return AtRate(spectrum(loop, T, delay), *largest_sample_time(loop, delay))
