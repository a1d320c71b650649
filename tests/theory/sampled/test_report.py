"""What the certificate says of sampling, for both experiments."""

from __future__ import annotations

import functools
import json

import numpy as np
import pytest

import alight
from alight.theory.case import case_of
from alight.theory.sampled import Sampled, sampled

BRIEF = {"duration": 0.2, "steady_state": 0.1}


@functools.cache
def report(name: str, *changes: tuple[str, object]) -> Sampled:
    scenario = alight.load_scenario(name, {**BRIEF, **dict(changes)})
    return sampled(case_of(scenario), scenario, alight.simulate(scenario, backend="vm"))


@pytest.mark.parametrize("name", ["experiment-1", "experiment-2"])
def test_every_phase_plant_and_delay_is_told_once(name):
    found = report(name)
    keys = {(loop.phase, loop.plant, loop.delay) for loop in found.loops}
    assert len(keys) == len(found.loops) == 8
    assert [loop.delay for loop in found.loops if loop.present] == [False] * 4
    for loop in found.loops:
        free = loop.phase == "free motion"
        assert loop.adapting is not None and loop.held is not None
        assert loop.adapting.now.free_mass.size == (2 if free else 0)
        assert loop.adapting.now.unexcited == loop.held.now.unexcited == 10 if free else 8
        for way in (loop.adapting, loop.held):
            assert (way.largest is None) == bool(way.undefined)
            if way.largest is not None and way.largest > found.T:
                assert way.now.radius < 1
        assert free == (loop.held is loop.adapting)


def test_the_gains_42_are_unstable_in_contact_without_losses_however_fast_they_are_sampled():
    for loop in report("experiment-1").loops:
        lossless_contact = (loop.phase, loop.plant) == ("contact", "lossless")
        assert (loop.adapting.largest is None) == lossless_contact


@pytest.mark.parametrize("name", ["experiment-1", "experiment-2"])
def test_at_2_kHz_the_adaptation_of_theta_r_is_too_fast_for_contact(name):
    found = report(name)
    decays = [c.holds for c in found.conditions if "spectral radius" in c.statement]
    assert decays == [False, False, True, True] and not found.stable
    for loop in found.loops:
        assert loop.held.now.radius < 1
    assert "contact, plant with its losses: spectral radius" in found.told
    blamed = found.told.split("With theta_r_hat held it is stable at that rate")[1]
    assert "contact, plant with its losses" in blamed
    assert ("lossless" in blamed) == (name == "experiment-2")  # LOC is to blame in experiment 1
    assert "theta_r_hat4 in" in found.told  # an estimate that bounces between its bounds


def test_a_faster_clock_and_losses_make_the_loop_decay():
    found = report("experiment-1", ("testbed.sample_rate", 4000.0))
    assert "plant with its losses" not in found.told  # nothing is wrong with it any more
    assert "plant lossless" in found.told and not found.stable
    calm = report("experiment-2", ("testbed.sample_rate", 20000.0), ("duration", 0.1))
    assert calm.stable
    assert calm.told.endswith("locally stable in contact and in free motion.")


def test_nothing_told_is_infinite_and_what_is_undefined_says_why():
    for name in ("experiment-1", "experiment-2"):
        found = report(name)
        for condition in found.conditions:
            assert np.isfinite([condition.left, condition.right]).all()
        for constant in found.constants:
            assert (constant.value is None) == bool(constant.undefined)
            assert constant.value is None or np.isfinite(constant.value)
        again = json.loads(json.dumps(found.as_dict(), allow_nan=False))
        assert again["loops"][0]["adapting"]["spectral_radius"] == found.conditions[0].left
        pairs = np.array(again["loops"][0]["adapting"]["eigenvalues"])
        assert np.hypot(*pairs.T).max() == pytest.approx(found.conditions[0].left)


def test_the_tables_hold_every_loop_and_every_estimate():
    loops, adaptation = report("experiment-1").tables()
    assert len(loops.rows) == 8 and len(adaptation.rows) == 11
    assert all(
        len(row) == len(table.columns) for table in (loops, adaptation) for row in table.rows
    )
    assert [row[0] for row in loops.rows if row[2].endswith("*")] == [
        *["contact"] * 2,
        *["free motion"] * 2,
    ]


def test_velocities_come_in_steps_of_a_count_over_a_sample():
    values = {c.symbol: c.value for c in report("experiment-1").constants}
    assert values["step of q_dot"] == pytest.approx(2 * np.pi / 614400 * 2000)
    bed = alight.load_scenario("experiment-1").testbed
    assert values["step of x_m_dot"] == pytest.approx(bed.transducer.resolution * 2000)


def test_a_loop_without_a_rest_says_why():
    found = report("experiment-1", ("testbed.motors.limit", (5.0, 5.0)))
    for condition in found.conditions[:2]:
        assert condition.holds is None and "testbed.motors clips" in condition.undefined
    assert "is not known to be stable: no rest in contact" in found.told and not found.stable
    for loop in found.loops:
        assert (loop.adapting is None) == (loop.phase == "contact")
    assert [row[3] for row in found.tables()[0].rows[:4]] == ["-"] * 4
    assert found.as_dict()["loops"][0]["adapting"] is None


def test_a_delay_of_the_testbed_is_the_present_one():
    found, other = report("experiment-1", ("testbed.delay", True)), report("experiment-1")
    assert all(loop.present == loop.delay for loop in found.loops)
    for one, two in zip(found.loops, other.loops, strict=True):
        assert one.adapting.now.radius == pytest.approx(two.adapting.now.radius, rel=1e-12)
