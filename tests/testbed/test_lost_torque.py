"""A torque that is no number ends the run, whatever runs it and whatever is recorded."""

from __future__ import annotations

import numpy as np
import pytest

from alight import Outcome
from alight.testbed import Motors
from tests.testbed.laws import BACKENDS, Losing, PlainLosing, PlainSteady, Steady, each_way, ran

EACH_WAY = each_way(Losing, PlainLosing)
LOST = pytest.mark.parametrize("lost", ["nan", "inf", "-inf"])
CHANNELS = [("x_m",), ("q", "elapsed"), ("tau",), ("tau_applied",)]
END = 0.0125  # [s]: the first sample at which the torque is no number


@EACH_WAY
@LOST
@pytest.mark.parametrize("joint", [1, 2])
def test_the_run_ends_at_that_sample_and_says_so(law, backend, lost, joint):
    recording = ran(law(lost=lost, joint=joint), backend=backend)
    verdict = recording.verdict
    assert verdict.outcome is Outcome.NOT_FINITE and not verdict.completed
    assert verdict.time == recording.t[-1] == pytest.approx(END, abs=1e-12)
    assert verdict.signal == "tau"
    assert "the law gave a torque that is infinite or not a number" in str(verdict)
    np.testing.assert_equal(recording[f"tau{joint}"][-1], float(lost))
    assert np.isfinite(recording.samples[:-1]).all()
    others = [c for c in recording.columns if c not in (f"tau{joint}", f"tau_applied{joint}")]
    assert all(np.isfinite(recording[name][-1]) for name in others)


@EACH_WAY
@pytest.mark.parametrize("channels", CHANNELS, ids="+".join)
def test_it_ends_there_whatever_is_recorded(law, backend, channels):
    whole = ran(law(lost="nan"), backend=backend)
    recording = ran(law(lost="nan"), channels=channels, backend=backend)
    assert recording.verdict == whole.verdict
    assert len(recording) == len(whole)
    assert set(recording.layout.signals) == set(channels)
    for name in channels:
        np.testing.assert_array_equal(recording[name], whole[name])


@EACH_WAY
@LOST
def test_a_delay_does_not_put_it_off(law, backend, lost):
    """The torque that is no number has not reached the joints yet."""
    recording = ran(law(lost=lost), backend=backend, delay=True)
    assert recording.verdict.signal == "tau"
    assert recording.t[-1] == pytest.approx(END, abs=1e-12)
    assert np.isfinite(recording["tau_applied"]).all()


@EACH_WAY
@LOST
def test_up_to_there_it_is_the_run_of_a_law_that_never_loses_its_torque(law, backend, lost):
    recording, sound = (
        ran(law(lost=lost, until=until), END, backend=backend) for until in (0.0123, 1e3)
    )
    assert recording.verdict.completed and sound.verdict.completed
    np.testing.assert_array_equal(recording.samples, sound.samples)


@EACH_WAY
@LOST
def test_a_law_that_notices_it_itself_is_believed(law, backend, lost):
    verdict = ran(law(lost=lost, tripping=True), backend=backend).verdict
    assert verdict.outcome is Outcome.TRIPPED
    assert verdict.cause == "its time is over"


@each_way(Steady, PlainSteady)
def test_a_torque_that_is_merely_huge_is_clipped(law, backend):
    recording = ran(law((1e200, 1e200)), backend=backend)
    assert recording.verdict.completed
    np.testing.assert_array_equal(recording["tau_applied"], [Motors().limit] * len(recording))


NOWHERE, UNLIMITED = (1e250, 1e250), Motors(limit=(1e299, 1e299))
"""A finite torque, and motors that give it: the arm is nowhere within the first sample."""


@each_way(Steady, PlainSteady)
def test_a_plant_that_is_no_number_ends_the_run_too(law, backend):
    verdict = ran(law(NOWHERE), backend=backend, motors=UNLIMITED).verdict
    assert not verdict.completed
    assert verdict.signal in ("q1", "q2", "q_dot1", "q_dot2")


@BACKENDS
def test_a_plant_that_is_no_number_ends_the_run_whatever_is_recorded(backend):
    law = Steady(NOWHERE)
    verdict = ran(law, backend=backend, channels=("x_m",), motors=UNLIMITED).verdict
    assert not verdict.completed
