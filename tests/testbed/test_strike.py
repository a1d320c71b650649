"""Tip friction along violent strikes in the closed loop: within its cone, the bristle within its.

The plant is integrated with a fixed step, which no rate of the friction may outrun.
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import alight
from alight import AlightError, Recording, Unsaturated
from alight.kernels.select import Backend
from alight.models import TipFriction
from tests.cli.command import OWN_ARM
from tests.strategies import between, log_between
from tests.testbed.laws import BACKENDS

RESPONSE = "plant.tip_friction.response"


FRICTION = {
    "plant.tip_friction.mu": 0.3,
    "plant.tip_friction.deflection": 1e-4,
    "plant.tip_friction.breakaway": 0.7,
    RESPONSE: 1e-3,
}
SHORT = {"duration": 0.6, "steady_state": 0.1, "substeps": 4}
STRIKES = pytest.mark.parametrize(
    ("name", "settings"),
    [
        ("experiment-1", FRICTION),
        (OWN_ARM, {**FRICTION, "plant.tip_friction.deflection": 1e-5}),  # it strikes more softly
    ],
    ids=["paper", "own arm"],
)
COARSEST = {"substeps": 1, RESPONSE: 5e-4}
"""One step in a response: the largest that is allowed."""


def struck(
    name: str, settings: dict[str, float], backend: Backend = "vm"
) -> tuple[Recording, TipFriction]:
    scenario = alight.load_scenario(name, {**SHORT, **settings})
    recording = alight.simulate(scenario, law=Unsaturated, backend=backend)
    assert recording.verdict.completed
    return recording, scenario.plant.tip_friction


def outruns_the_bristle(recording: Recording, friction: TipFriction) -> bool:
    """Whether the tip slips faster than the bristle can bend."""
    slip = np.abs(recording["x_r_dot"][:, 1]) * recording["Lambda"]
    return bool(slip.max() > friction.deflection / friction.response)


@BACKENDS
@STRIKES
def test_along_a_violent_strike_friction_stays_in_its_cone_and_the_bristle_in_its_reach(
    name, settings, backend
):
    recording, friction = struck(name, settings, backend)
    F_t, F_m, z = (recording[signal] for signal in ("F_t", "F_m", "z"))
    assert outruns_the_bristle(recording, friction)
    assert (np.abs(F_t) <= friction.mu * F_m).all()
    assert (np.abs(z) <= friction.deflection * (1 + 1e-9)).all()
    slides = np.abs(z) > 0.99 * friction.deflection
    assert (slides & (np.abs(F_t) > 0.99 * friction.mu * F_m) & (F_m > 1)).any()


@STRIKES
def test_the_coarsest_step_that_is_allowed_does_not_lose_the_bristle(name, settings):
    """It may step past its deflection, by a half at most; the force knows its cone."""
    recording, friction = struck(name, {**settings, **COARSEST})
    assert outruns_the_bristle(recording, friction)
    assert (np.abs(recording["F_t"]) <= friction.mu * recording["F_m"]).all()
    assert recording.peak("z") <= 1.5 * friction.deflection


# What no step could follow is refused


@given(log_between(100.0, 1e4), st.integers(1, 16), between(0.1, 0.99))
def test_a_response_shorter_than_the_integrators_step_is_refused(rate, substeps, share):
    step = 1 / (rate * substeps)

    def scenario(response: float, substeps: int = substeps) -> alight.Scenario:
        settings = {"testbed.sample_rate": rate, "substeps": substeps}
        return alight.load_scenario(OWN_ARM, {**settings, RESPONSE: response})

    with pytest.raises(AlightError) as refusal:
        scenario(share * step)
    for part in (
        f"{RESPONSE} = {share * step:g} s",
        f"step of {step:g} s",
        "raise it, or substeps",
    ):
        assert part in str(refusal.value)
    assert scenario(1.001 * step).plant.tip_friction.response == 1.001 * step
    assert scenario(share * step, 20 * substeps).document.substeps == 20 * substeps


def test_a_response_of_exactly_one_step_is_allowed():
    scenario = alight.load_scenario(OWN_ARM, COARSEST)
    assert scenario.plant.tip_friction.response * scenario.testbed.sample_rate == 1
