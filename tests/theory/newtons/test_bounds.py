"""The table of bounds of both experiments: what it must say, and that it says nothing else."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
import pytest

import alight
from alight.errors import AlightError, UnknownName
from alight.models import HuntCrossley
from alight.theory.case import case_of
from alight.theory.newtons import Bound, bounds_in_newtons, lyapunov_along

EXPERIMENTS = ("experiment-1", "experiment-2")
each = pytest.mark.parametrize("name", EXPERIMENTS)


@functools.cache
def recorded(name: str) -> alight.Recording:
    return alight.simulate(name)


@functools.cache
def table(name: str) -> dict[str, Bound]:
    scenario = alight.load_scenario(name)
    bounds = bounds_in_newtons(case_of(scenario), scenario, recorded(name))
    found = {bound.name: bound for bound in bounds}
    assert len(found) == len(bounds), "two bounds of one name"
    return found


@each
def test_each_bound_has_a_finite_value_or_says_why_not(name):
    for bound in table(name).values():
        assert (bound.value is None) == bool(bound.undefined), bound.name
        numbers = (bound.value, bound.lower, bound.simulated, bound.known, bound.ratio)
        assert all(v is None or np.isfinite(v) for v in numbers), bound.name
        assert bound.meaning.endswith(".") and bound.unit, bound.name


@each
def test_what_is_proven_of_any_plant_holds_in_the_run(name):
    """Friction, sensors and clipping included: these rest on the law and on mechanics alone."""
    for bound in table(name).values():
        if bound.proven != "proven" or bound.size is None or "final" in bound.name:
            continue
        assert bound.simulated <= bound.size * (1 + 1e-9), bound.name


def test_the_feedback_of_32_adds_no_more_than_1_and_k3():
    found = table("experiment-1")
    first, second = (found[f"feedback force, axis X{i}"] for i in (1, 2))
    assert (first.value, second.value) == (96.0, 6.0)
    assert not first.vacuous and first.ratio < 1.1
    start = found["feedback torque in the pose of the start, joint 1"]
    assert start.value == pytest.approx(0.436 * 96 + 0.060 * 6, rel=1e-5)  # (40), counts


def test_the_feedback_of_44_has_no_bound_of_its_own():
    found = table("experiment-2")
    assert found["feedback force, axis X1"].undefined == "the feedback grows with the errors"
    assert "not below the 25.7 N m" in found["feedback torque in every pose, joint 1"].vacuous


@each
def test_the_first_command_is_that_of_the_run(name):
    scenario = alight.load_scenario(name)
    recording = recorded(name)
    for i in (1, 2):
        for quantity in ("F", "tau"):
            bound = table(name)[f"{quantity}(0), entry {i}"]
            assert bound.value == pytest.approx(recording[f"{quantity}{i}"][0], rel=2e-3)
    limit = scenario.testbed.motors.clip(np.array([1e9, 1e9]))
    assert table(name)["tau(0), entry 1"].known == limit[0]
    assert table(name)["tau(0), entry 1"].beyond == (name == "experiment-2")


@each
def test_the_force_at_rest_is_that_of_the_spring(name):
    bound = table(name)["final contact force with the true spring"]
    assert bound.ratio == pytest.approx(1, abs=1e-3)
    interval = table(name)["final contact force"]
    assert interval.lower < bound.value < interval.value


@each
def test_the_identity_misses_only_what_sensors_and_damper_add(name):
    found = table(name)
    elastic = found["largest deviation of that identity from the elastic part"].simulated
    whole = found["largest deviation of that identity from the whole contact force"].simulated
    assert elastic < 0.02 * found["peak contact force from the law's signals"].simulated
    assert whole > 100 * elastic


def test_a_bound_wider_than_the_workspace_is_called_vacuous():
    assert "workspace" in table("experiment-1")["tracking error, axis X2"].vacuous
    assert not table("experiment-2")["tracking error, axis X2"].vacuous


@each
def test_the_bound_of_the_impact_speed_is_called_vacuous_here(name):
    found = table(name)
    assert "times what the run shows" in found["speed of the tip at the first touch"].vacuous
    impact = found["peak force of the first impact, from that bound"]
    assert impact.proven == "heuristic" and impact.vacuous


@each
def test_proposition_B_says_nothing_without_VTX(name):
    bound = table(name)["contact force in lasting contact, by Proposition B"]
    assert bound.value is None and "VTX fails" in bound.undefined


def test_a_bound_that_is_an_equality_is_never_vacuous():
    made = Bound("a", "a = b", "N", "identity", "A test.", value=50.0, simulated=1.0, known=3.0)
    assert made.vacuous == "" and made.beyond and made.ratio == 50
    proven = dataclasses.replace(made, proven="proven")
    assert proven.vacuous == "not below the 3 N of "
    assert dataclasses.replace(proven, known=None).vacuous == "50 times what the run shows"
    assert dataclasses.replace(proven, known=60.0, simulated=9.0).vacuous == ""
    assert dataclasses.replace(proven, simulated=0.0).ratio is None


def test_a_recording_with_samples_missing_is_refused():
    scenario = alight.load_scenario("experiment-1")
    thinned = alight.simulate(scenario, every=2)
    with pytest.raises(AlightError, match="every sample of experiment-1"):
        bounds_in_newtons(case_of(scenario), scenario, thinned)


def test_a_recording_with_signals_missing_is_refused():
    scenario = alight.load_scenario("experiment-1")
    poor = alight.simulate(scenario, channels=("q", "gap"))
    with pytest.raises(UnknownName):
        bounds_in_newtons(case_of(scenario), scenario, poor)


@each
def test_the_lyapunov_functions_along_a_recording_start_at_their_bounds(name):
    scenario = alight.load_scenario(name)
    found = lyapunov_along(case_of(scenario), recorded(name))
    assert list(found) == ["V", "V_m", "V_r", "V_r over the boxes"]
    assert found["V"].upper is None and (found["V"].value >= found["V_r"].value).all()
    assert found["V_r"].value[0] == found["V_r"].upper[0]
    assert found["V_r over the boxes"].excess < 0


def test_for_a_contact_that_hardens_zeta_K_bounds_no_force():
    scenario = alight.load_scenario("experiment-1")
    plant = dataclasses.replace(scenario.plant, contact=HuntCrossley(K_I=1e6, exponent=1.5))
    document = dataclasses.replace(scenario.document, plant=plant, duration=2.5)
    hardening = dataclasses.replace(scenario, document=document)
    bounds = bounds_in_newtons(case_of(hardening), hardening, alight.simulate(hardening))
    found = {bound.name: bound for bound in bounds}
    undefined = found["peak contact force from the law's signals"]
    assert undefined.value is None and "not linear" in undefined.undefined
    energy = found["elastic contact force from the work of the motors, at the peak of the force"]
    assert energy.simulated <= energy.value
