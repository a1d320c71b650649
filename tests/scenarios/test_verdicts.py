"""How a run ends: at its end, or early with a verdict and the recording up to there."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
import pytest

import alight
from alight import Law, Measurement, Outcome, Tick
from alight.scenarios.simulate import RunFailed
from alight.symbolic.ops import vector
from alight.symbolic.parameters import parameters
from alight.symbolic.signals import Signal
from tests.cli.command import OWN_ARM


@parameters
class Kick(Law):
    """Turns both motors up to the last."""

    states: ClassVar[Mapping[str, Signal]] = {"s": Signal("s", "time since the start")}

    def initial_state(self) -> dict[str, Any]:
        return {"s": 0.0}

    def tick(self, state: Mapping[str, Any], measured: Measurement, dt: Any) -> Tick:
        return Tick(vector(1e8, 1e7), {"s": state["s"] + dt}, {})


FILTER = ("law.gains.alpha1=5000",)
"""|alpha1 tanh(e_m)| far above alpha2 before the contact: u_f runs out of its domain."""
PLANT = (f"law.type={__name__}:Kick", "testbed.motors.limit=[1e7, 1e7]")
"""More torque than any arm stands, and motors that give it."""
LIGHT = ("plant.body.m=1e-5",)
"""A contact ten times faster than the integrator."""
OVERFLOW = ("testbed.motors.limit=[1e300, 1e300]", "law.gains.k3=[1e200, 1e200]")

ENDINGS = pytest.mark.parametrize(
    ("settings", "outcome", "signals"),
    [
        (FILTER, Outcome.TRIPPED, {"u_f"}),
        (PLANT, Outcome.DIVERGED, {"q_dot1", "q_dot2"}),
        (LIGHT, Outcome.DIVERGED, {"x_m", "x_m_dot", "q_dot1", "q_dot2"}),
        (OVERFLOW, Outcome.DIVERGED, {"q1", "q_dot1"}),
    ],
    ids=["filter", "plant", "light", "overflow"],
)
BACKENDS = pytest.mark.parametrize("backend", ["auto", "vm"])


@ENDINGS
@BACKENDS
def test_a_run_that_cannot_go_on_says_when_by_which_signal_and_why(
    settings, outcome, signals, backend
):
    scenario = alight.load_scenario(OWN_ARM, settings)
    run = alight.simulate(scenario, backend=backend)
    verdict = run.verdict
    assert verdict.outcome is outcome and not verdict.completed
    assert verdict.time == run.t[-1] < scenario.document.duration / 2
    assert verdict.signal in signals and verdict.signal in run
    assert verdict.cause
    for part in (f"{verdict.time:.4g} s", verdict.signal, verdict.cause, outcome.value):
        assert part in str(verdict)


@ENDINGS
def test_the_recording_is_kept_up_to_the_sample_that_ended_it(settings, outcome, signals):
    """It is the beginning of the run, unchanged: no row is lost, none is made up."""
    run = alight.simulate(alight.load_scenario(OWN_ARM, settings))
    assert 1 <= len(run) < 6 * 2000
    assert np.isfinite(run.samples[:-1]).all()
    np.testing.assert_allclose(np.diff(run.t), 5e-4)
    if len(run) > 2:
        length = (len(run) - 1) / 2000
        until = [*settings, f"duration={length}", f"steady_state={length / 2}"]
        shorter = alight.simulate(alight.load_scenario(OWN_ARM, until))
        assert shorter.verdict.completed
        np.testing.assert_array_equal(shorter.samples, run.samples[:-1])


def test_the_printed_gains_with_alpha1_a_hundredfold_trip_on_the_papers_arm():
    run = alight.simulate(alight.load_scenario("experiment-1", FILTER))
    assert run.verdict.outcome is Outcome.TRIPPED
    assert run.verdict.time < 0.01
    assert "e_f escaped to infinity" in str(run.verdict)
    assert abs(run["u_f"]).max() < 1  # the state that would have left the domain is not recorded


def test_whoever_asks_gets_an_error_that_holds_the_recording():
    scenario = alight.load_scenario(OWN_ARM, FILTER)
    with pytest.raises(RunFailed) as caught:
        alight.simulate(scenario, throw=True)
    assert str(caught.value) == str(caught.value.recording.verdict)
    kept = alight.simulate(scenario)
    np.testing.assert_array_equal(caught.value.recording.samples, kept.samples)


def test_a_run_to_its_end_has_every_sample_and_raises_nothing():
    scenario = alight.load_scenario(OWN_ARM, ["duration=0.1", "steady_state=0.05"])
    run = alight.simulate(scenario, throw=True)
    assert run.verdict.outcome is Outcome.COMPLETED
    assert len(run) == 200 and run.verdict.signal is None and run.verdict.cause is None
