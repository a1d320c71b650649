"""What a run asks of a law: no state, no parameters, no more memory than there is."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from alight import AlightError
from alight.control import Law, Measurement, Tick
from alight.errors import UnknownName
from alight.symbolic.parameters import is_parameters
from tests.testbed.laws import BACKENDS, Braking, PlainBraking, PlainSteady, Steady, each_way, ran

# Without state, without parameters


@BACKENDS
@pytest.mark.parametrize(
    ("law", "plain"),
    [(Braking(2.0), PlainBraking(2.0)), (Steady((3.0, -1.0)), PlainSteady((3.0, -1.0)))],
    ids=["no parameter set", "parameter set"],
)
def test_a_law_without_state_runs(backend, law, plain):
    recording = ran(law, backend=backend)
    assert recording.verdict.completed and len(recording) == 400
    expected = [law.tick({}, seen, 5e-4).tau for seen in measurements(recording)]
    np.testing.assert_array_equal(recording["tau"], expected)
    assert_close(ran(plain), recording)


def measurements(recording: Any) -> list[Measurement]:
    columns = [recording[f"{name}_measured"] for name in Measurement._fields]
    return [Measurement(*values) for values in zip(*columns, strict=True)]


def assert_close(one: Any, other: Any) -> None:
    """Equal to rounding, each signal by its own scale."""
    assert one.columns == other.columns
    for name in other.columns:
        rounding = 1e-9 * other.peak(name) + 1e-15
        np.testing.assert_allclose(one[name], other[name], rtol=0, atol=rounding, err_msg=name)


@BACKENDS
def test_laws_that_are_no_parameter_sets_do_not_share_what_stands_in_them(backend):
    assert not is_parameters(Braking(1.0))
    weak, strong = (ran(Braking(gain), backend=backend) for gain in (1.0, 5.0))
    np.testing.assert_array_equal(weak["tau"][0] * 5.0, strong["tau"][0])
    assert strong.peak("q_dot")[1] <= weak.peak("q_dot")[1]


@BACKENDS
def test_a_number_changed_in_such_a_law_counts_in_the_next_run(backend):
    law = Braking(1.0)
    weak = ran(law, backend=backend)
    law.gain = 5.0
    np.testing.assert_array_equal(weak["tau"][0] * 5.0, ran(law, backend=backend)["tau"][0])


# What is recorded of it


@each_way(Braking(1.0), PlainBraking(1.0))
def test_channels_are_those_asked_for_in_the_order_of_the_loop(law, backend):
    whole = ran(law, 0.01, backend=backend)
    recording = ran(law, 0.01, backend=backend, channels=("tau", "x_m"))
    assert list(recording.layout.signals) == ["x_m", "tau"]
    for name in ("x_m", "tau"):
        np.testing.assert_array_equal(recording[name], whole[name])


@BACKENDS
def test_a_channel_that_is_no_signal_is_refused(backend):
    with pytest.raises(UnknownName, match=r"unknown signal 'torque'; one of: .*tau"):
        ran(Braking(1.0), 0.01, backend=backend, channels=("torque",))


def test_a_channel_that_is_no_signal_of_a_plain_law_is_refused_too():
    with pytest.raises(UnknownName, match=r"unknown signal 'torque'; one of: .*tau"):
        ran(PlainBraking(1.0), 0.01, channels=("torque", "tau"))


# More than the machine holds


class Unasked(PlainBraking):
    """Must not be asked for a torque."""

    def tick(self, state: Mapping[str, Any], measured: Measurement, dt: Any) -> Tick:
        raise AssertionError("the run has begun")


@each_way(Braking(1.0), Unasked(1.0))
def test_a_recording_that_no_memory_holds_is_refused_before_the_run(law, backend):
    with pytest.raises(AlightError, match=r"2e\+13 samples .* needs .* GB.*shorter duration"):
        ran(law, 1e10, backend=backend)


def test_the_refusal_counts_what_is_recorded():
    def needed(law: Law, channels: tuple[str, ...] | None) -> float:
        with pytest.raises(AlightError) as refusal:
            ran(law, 1e10, channels=channels)
        found = re.search(r"needs (\S+) GB, and this machine has (\S+) GB", str(refusal.value))
        assert found and float(found[2]) < float(found[1])
        return float(found[1])

    law = Braking(1.0)
    assert needed(law, ("x_m",)) < needed(law, ("x_m", "q", "tau")) < needed(law, None)
    assert needed(law, ("x_m",)) >= 2e13 * 8 / 1e9
