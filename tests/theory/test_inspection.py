"""`alight.inspect`: what it takes, and that it shows what the parts of Alight show one by one."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import alight
from alight.errors import AlightError
from tests.control.cases import EXPERIMENT_1, TARGET

INPUTS: dict[str, Any] = json.loads(
    (Path(__file__).parents[1] / "paper" / "vectors.json").read_text("utf-8")
)["cases"][0]["inputs"]


def assert_same(first: dict[str, Any], second: dict[str, Any]) -> None:
    assert set(first) == set(second)
    for name, value in first.items():
        np.testing.assert_array_equal(value, second[name], err_msg=name)


def test_entries_may_come_as_a_mapping_as_keywords_or_as_both():
    whole = alight.inspect(INPUTS)
    assert_same(whole, alight.inspect(**INPUTS))
    part = {name: INPUTS[name] for name in ("plant", "ref")}
    rest = {name: value for name, value in INPUTS.items() if name not in part}
    assert_same(whole, alight.inspect(part, **rest))


def test_what_it_returns_are_plain_numbers_and_arrays():
    for name, value in alight.inspect(INPUTS).items():
        assert isinstance(value, float | np.ndarray), name
        assert np.isfinite(value).all(), name
        assert np.shape(value) in {(), (2,), (10,), (2, 2), (2, 10)}, name


def test_a_scenario_is_inspected_at_its_start():
    found = alight.inspect("experiment-1")
    scenario = alight.load_scenario("experiment-1")
    np.testing.assert_allclose(found["x_r"], [0.060, 0.436], atol=1e-12)  # (40)
    assert found["e_m"] == pytest.approx(TARGET.x_md - 0.206)
    assert found["Lambda"] == found["F_m"] == 0
    assert found["eta_m"] == pytest.approx(EXPERIMENT_1.alpha1 * np.tanh(found["e_m"]))
    np.testing.assert_array_equal(found["x_r_dot"], 0.0)
    assert_same(found, alight.inspect(scenario))


def test_the_torques_of_a_scenario_are_those_of_its_first_sample():
    """Friction is not in what `inspect` shows, and the law does not know it either."""
    scenario = alight.load_scenario("experiment-1", {"testbed.encoder.counts": 0.0})
    law, start = scenario.law, scenario.start
    seen = alight.Measurement(np.array(start.q), np.zeros(2), start.x_m, 0.0)
    tick = law.tick(law.initial_state(), seen, 5e-4)
    found = alight.inspect(scenario)
    np.testing.assert_allclose(found["tau_eq32"], tick.tau, rtol=1e-9)


def test_with_a_scenario_any_part_of_the_state_can_be_replaced():
    at_rest = alight.inspect("experiment-1")
    moved = alight.inspect("experiment-1", state={"x_m_dot": 0.1, "e_f": 0.2})
    g = EXPERIMENT_1
    expected = -0.1 + g.alpha1 * np.tanh(moved["e_m"]) + g.alpha2 * np.tanh(0.2)
    assert moved["eta_m"] == pytest.approx(expected)
    np.testing.assert_array_equal(moved["x_r"], at_rest["x_r"])


@pytest.mark.parametrize("entry", sorted(INPUTS))
def test_a_missing_entry_is_named(entry):
    rest = {name: value for name, value in INPUTS.items() if name != entry}
    with pytest.raises(AlightError, match=entry):
        alight.inspect(rest)


@pytest.mark.parametrize(
    ("where", "name", "value", "message"),
    [
        ("plant", "m", -1.0, "m = -1.0"),
        ("plant", "p", [1.0, 2.0, 3.0], "positive definite"),
        ("gains", "alpha1", float("nan"), "alpha1"),
        ("gains", "Gamma_r", [1.0] * 9, "Gamma_r needs 10 entries"),
        ("proj_dk", "lo", 1.0, "lo = 1.0: must lie below"),
        ("ref", "x_md", "far", "x_md"),
    ],
    ids=str,
)
def test_a_bad_value_is_refused_with_its_name(where, name, value, message):
    changed = {**INPUTS, where: {**INPUTS[where], name: value}}
    with pytest.raises(AlightError, match=message):
        alight.inspect(changed)


@pytest.mark.parametrize(
    "changes",
    [{"stat": {}}, {"state": {**INPUTS["state"], "speed": 1.0}}, {"state": {"q": [0.0, 1.0]}}],
    ids=["unknown entry", "unknown state", "missing states"],
)
def test_unknown_and_missing_names_are_refused(changes):
    with pytest.raises(AlightError):
        alight.inspect({**INPUTS, **changes})


@pytest.mark.parametrize(
    ("where", "name"), [(where, name) for where in INPUTS for name in sorted(INPUTS[where])]
)
def test_a_missing_number_is_refused_with_its_name(where, name):
    short = {key: value for key, value in INPUTS[where].items() if key != name}
    with pytest.raises(AlightError, match=f"{where}.*needs.*'{name}'"):
        alight.inspect({**INPUTS, where: short})


@pytest.mark.parametrize("where", sorted(INPUTS))
@pytest.mark.parametrize("entry", [{"mystery": 1.0}, {}, 1.0, None], ids=str)
def test_an_entry_of_other_names_or_no_names_is_refused(where, entry):
    with pytest.raises(AlightError, match=where):
        alight.inspect({**INPUTS, where: entry})


def test_wrong_shapes_and_numbers_of_the_state_are_refused():
    for name, value in (
        ("q", [0.1, 0.2, 0.3]),
        ("theta_r_hat", [1.0] * 9),
        ("x_m", float("nan")),
        ("q_dot", [0.0, float("inf")]),
    ):
        with pytest.raises(AlightError, match=name):
            alight.inspect({**INPUTS, "state": {**INPUTS["state"], name: value}})


def test_a_law_without_estimates_is_refused():
    scenario = alight.load_scenario("experiment-1", {"law.type": "exact-model"})
    with pytest.raises(AlightError, match="ExactModel is not an adaptive law"):
        alight.inspect(scenario)


def test_what_a_scenario_cannot_take_is_refused():
    with pytest.raises(AlightError):
        alight.inspect("experiment-1", state={"speed": 1.0})
    with pytest.raises(AlightError):
        alight.inspect("experiment-1", gains={})
