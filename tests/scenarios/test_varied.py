"""A number that varies is that of a scenario loaded with it, or refused as that one is."""

from __future__ import annotations

from functools import cache
from typing import Any

import casadi as ca
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

import alight
from alight.errors import AlightError, InvalidParameters, UnknownName
from alight.scenarios import load_scenario, simulate_batch
from alight.scenarios.scenario import Scenario
from alight.scenarios.varied import MOST, Variation
from alight.simulation.batch import _parameters
from alight.simulation.closed_loop import InitialState, initial_program
from alight.symbolic.parameters import numeric_fields

BASE = load_scenario("experiment-1")
UPRIGHT = {"law.type": "exact-model", "plant.arm.plane": "vertical", "plant.arm.g1": 1.0}
VERTICAL = load_scenario("experiment-1", UPRIGHT)
NONE: frozenset[str] = frozenset()


def paths_of(scenario: Scenario) -> dict[str, Any]:
    """Every number of a scenario that a batch may vary, found by reading its parts."""
    document = scenario.document
    parts = {name: getattr(document, name) for name in ("plant", "testbed", "start", "target")}
    found = {p: v for n, part in parts.items() for p, v, _ in numeric_fields(part, f"{n}.")}
    told = ("law.model.", "law.target.")
    law = {p: v for p, v, _ in numeric_fields(scenario.law, "law.") if not p.startswith(told)}
    return {**found, **law}


PATHS = paths_of(BASE)


def nearby(value: Any) -> Any:
    """A value so close that no bound lies between."""
    near = np.where(np.asarray(value) == 0, 1e-9, np.asarray(value, dtype=float) * (1 + 1e-9))
    return near.tolist()


def array_of(*values: Any) -> np.ndarray:
    return np.array([np.asarray(v, dtype=float) for v in values])


@cache
def initial(plane: str) -> ca.Function:
    """State at the start from start and parameters, whatever these are."""
    loop = (BASE if plane == "horizontal" else VERTICAL).closed_loop
    return initial_program(loop, InitialState((0.0, 0.0), 0.0), NONE)


def columns(variation: Variation) -> tuple[np.ndarray, np.ndarray]:
    """Parameters of the loop and states at the start, a column for each run."""
    runs = variation.runs()
    p = _parameters(variation.loop, NONE, runs)
    return p, np.asarray(initial(variation.scenario.plant.arm.plane)(runs.start, p))


def columns_of(scenario: Scenario) -> tuple[np.ndarray, np.ndarray]:
    loop, start = scenario.closed_loop, scenario.start
    p, begun = loop.parameter_values(), [*start.q, start.x_m, *start.q_dot, start.x_m_dot]
    x = initial(scenario.plant.arm.plane)(np.array(begun), p)
    assert np.allclose(np.asarray(x).ravel(), loop.initial_column(start), rtol=1e-12, atol=1e-15)
    return p, np.asarray(x).ravel()


@pytest.mark.parametrize("path", [path for path in PATHS if path != "testbed.sample_rate"])
def test_a_varied_number_is_that_of_the_scenario_loaded_with_it(path):
    value, near = PATHS[path], nearby(PATHS[path])
    try:
        loaded = load_scenario("experiment-1", {path: near})
    except AlightError:
        with pytest.raises(InvalidParameters, match=r"varied\n  .*run 1"):
            Variation(BASE, {path: array_of(value, near)})
        return
    p, x = columns(Variation(BASE, {path: array_of(value, near)}))
    for column, scenario in enumerate((BASE, loaded)):
        p_single, x_single = columns_of(scenario)
        assert np.array_equal(p[:, column], p_single)
        assert np.array_equal(x[:, column], x_single)
    assert not np.array_equal(p[:, 0], p[:, 1]) or not np.array_equal(x[:, 0], x[:, 1])


def test_gravity_torques_reach_the_plant_and_what_the_law_knows_of_it():
    loaded = load_scenario("experiment-1", {**UPRIGHT, "plant.arm.g1": 1.5})
    p, _ = columns(Variation(VERTICAL, {"plant.arm.g1": np.array([1.0, 1.5])}))
    assert np.array_equal(p[:, 1], loaded.closed_loop.parameter_values())
    for place in ("plant.arm.g1", "law.model.arm.g1"):
        assert p[VERTICAL.closed_loop.parameter_rows(NONE)[place]].ravel().tolist() == [1.0, 1.5]


@given(
    st.lists(st.sampled_from(sorted(set(PATHS) - {"testbed.sample_rate"})), max_size=6, min_size=2),
    st.integers(1, 4),
)
def test_several_numbers_vary_together(paths, count):
    paths = [path for path in paths if path not in ("plant.arm.g1", "plant.arm.g2")]
    assume(paths)
    either = {path: (nearby(PATHS[path]), PATHS[path]) for path in paths}
    values = {path: [pair[i > 0] for i in range(count)] for path, pair in either.items()}
    p, x = columns(Variation(BASE, {path: array_of(*v) for path, v in values.items()}))
    for i in range(count):
        loaded = load_scenario("experiment-1", {path: v[i] for path, v in values.items()})
        p_single, x_single = columns_of(loaded)
        assert np.array_equal(p[:, i], p_single) and np.array_equal(x[:, i], x_single)


@pytest.mark.parametrize(("mu", "steps"), [([0.0, 0.0], 1), ([0.0, 0.5], 2), ([0.5, 0.9], 2)])
@pytest.mark.parametrize("base", [0.0, 0.9])
def test_a_batch_takes_as_many_integrator_steps_as_its_roughest_run(base, mu, steps):
    scenario = load_scenario("experiment-1", {"plant.tip_friction.mu": base})
    assert Variation(scenario, {"plant.tip_friction.mu": np.array(mu)}).loop.substeps == steps
    fixed = load_scenario("experiment-1", {"plant.tip_friction.mu": base, "substeps": 3})
    assert Variation(fixed, {"plant.tip_friction.mu": np.array(mu)}).loop.substeps == 3


def test_seeds_are_those_given_or_that_of_the_scenario():
    seeded = load_scenario("experiment-1", {"seed": 5})
    masses = {"plant.body.m": np.array([1.7, 1.8])}
    assert Variation(seeded, masses).seeds.tolist() == [5, 5]
    assert Variation(seeded, {**masses, "seed": np.array([3, 4])}).seeds.tolist() == [3, 4]
    assert Variation(seeded, {"seed": [8, 9, 10]}).count == 3


def test_travel_is_from_where_the_mass_rests_to_where_it_shall_be():
    varied = {"plant.body.x_0": [0.2, 0.21], "target.x_md": [0.24, 0.2]}
    assert np.allclose(Variation(BASE, varied).runs().travel, [0.04, 0.01], rtol=1e-12)


# What is refused


def at(run: int, value: Any, path: str, count: int = 20) -> np.ndarray:
    values = array_of(*[PATHS[path]] * count)
    values[run] = value
    return values


REFUSED = {
    "nothing": ({}, "nothing varies; name at least one path"),
    "unknown path": ({"plant.body.mass": [1.0]}, r"plant.body.mass: is no number .*: seed, plant"),
    "a table": ({"plant.body": [1.0]}, "plant.body: is no number of this scenario"),
    "what the law is told": ({"law.model.body.m": [1.0]}, "law.model.body.m: is no number"),
    "a text": ({"plant.arm.plane": ["vertical"]}, "plant.arm.plane: is no number"),
    "length of the run": ({"duration": [1.0]}, "duration: is no number of this scenario"),
    "sample rate": ({"testbed.sample_rate": [1e3, 2e3]}, "testbed.sample_rate: is shared by all"),
    "one number": ({"plant.body.m": 1.8}, "arrays must be of one length, at least 1; plant.body.m"),
    "no run": ({"plant.body.m": []}, "arrays must be of one length, at least 1; plant.body.m: 0"),
    "unequal": (
        {"plant.body.m": [1.8, 1.9], "law.e_f": [0.0]},
        "one length, at least 1; plant.body.m: 2, law.e_f: 1",
    ),
    "ragged": ({"law.gains.k3": [[1.0, 2.0], [1.0]]}, "law.gains.k3: its values are not of one"),
    "vector for a number": (
        {"plant.body.m": [[1.8, 1.9]]},
        r"plant.body.m: has shape \(1, 2\) of float64; needs numbers, shape \(1,\)",
    ),
    "number for a vector": (
        {"law.gains.k3": [90.0, 95.0]},
        r"law.gains.k3: has shape \(2,\) of float64; needs numbers, shape \(2, 2\)",
    ),
    "strings": ({"plant.body.m": ["1.8", "x"]}, r"plant.body.m: has shape \(2,\) of <U3; needs"),
    "objects": ({"plant.body.m": [None, 1.0]}, r"plant.body.m: has shape \(2,\) of object; needs"),
    "truth": ({"plant.body.m": [True]}, r"plant.body.m: has shape \(1,\) of bool; needs"),
    "complex": ({"plant.body.m": [1j]}, "of complex128; needs numbers"),
    "negative mass": (
        {"plant.body.m": at(17, -1.0, "plant.body.m")},
        r"plant.body.m, run 17 = -1.0: Input should be greater than 0",
    ),
    "nan": (
        {"plant.body.m": at(3, np.nan, "plant.body.m")},
        r"plant.body.m, run 3 = nan: Input should be (a finite number|greater than 0)",
    ),
    "infinite": ({"plant.arm.l1": at(3, np.inf, "plant.arm.l1")}, "plant.arm.l1, run 3 = inf"),
    "entry of a vector": (
        {"plant.arm.viscous": at(4, [1.0, -2.0], "plant.arm.viscous")},
        r"plant.arm.viscous, run 4.1 = -2.0: Input should be greater than or equal to 0",
    ),
    "inertia": (
        {"plant.arm.p1": at(2, 1.0, "plant.arm.p1"), "plant.arm.p3": at(2, 0.5, "plant.arm.p3")},
        r"plant.arm, run 2: p1 = 1.0, .*p3 = 0.5 give an inertia matrix that is not positive",
    ),
    "estimate": (
        {"law.theta_dk.initial": at(6, 9.0, "law.theta_dk.initial")},
        r"law.theta_dk, run 6: initial = 9.0 must lie between lower = 0.0019.* and upper = 0.04",
    ),
    "bounds": (
        {"law.theta_dk.lower": at(6, 9.0, "law.theta_dk.lower")},
        r"law.theta_dk, run 6: lower = 9.0 must lie below upper",
    ),
    "bristle": (
        {"plant.tip_friction.response": at(5, 1e-6, "plant.tip_friction.response")},
        r"plant.tip_friction.response, run 5 = 1e-06: is shorter than the integrator's step",
    ),
    "target": (
        {"target.x_md": at(9, 5.0, "target.x_md")},
        r"run 9: the tip position \(5, 0.358\) m .* reaches",
    ),
    "start": (
        {"start.x_r": at(9, [0.0, 9.0], "start.x_r")},
        r"run 9: the tip position \(0, 9\) m is 9 m from .* reaches",
    ),
    "arm too short": ({"plant.arm.l1": at(9, 0.01, "plant.arm.l1")}, "run 9: .*reach"),
    "seed": ({"seed": [1.5]}, "seed: must be whole numbers, 0 or more, one a run"),
    "negative seed": ({"seed": [1, -1]}, "seed: must be whole numbers, 0 or more, one a run"),
    "seeds as a vector": ({"seed": [[1, 2]]}, "seed: must be whole numbers, 0 or more, one a run"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_wrong_is_refused_with_path_run_and_value(case):
    varied, message = REFUSED[case]
    with pytest.raises(InvalidParameters, match=rf"varied\n  .*{message}"):
        simulate_batch(BASE, varied)


def test_only_the_first_of_many_problems_are_shown():
    with pytest.raises(InvalidParameters) as caught:
        Variation(BASE, {"plant.body.m": -np.ones(100)})
    assert len(caught.value.problems) == MOST + 1
    assert caught.value.problems[-1] == f"and {100 - MOST} more"


def masses(count: int = 2) -> dict[str, np.ndarray]:
    return {"plant.body.m": np.full(count, 1.8)}


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"metrics": ["peek"]}, "unknown metric 'peek'; one of: chatter"),
        ({"channels": ["F_x"]}, "unknown signal 'F_x'; one of: .*F_m"),
        ({"backend": "gpu"}, "unknown backend 'gpu'; one of: auto, c, vm"),
        ({"width": 3}, "unknown width 3; one of: 1, 2, 4, 8"),
    ],
)
def test_unknown_names_are_refused_with_the_known_ones(settings, message):
    with pytest.raises(UnknownName, match=message):
        simulate_batch(BASE, masses(), **settings)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"every": 0}, "every = 0: must be a whole number, 1 or more"),
        ({"every": 2.5}, "every = 2.5: must be a whole number, 1 or more"),
        ({"threads": 0}, "threads = 0: must be 1 or more"),
        ({"threads": -2}, "threads = -2: must be 1 or more"),
    ],
)
def test_settings_that_make_no_sense_are_refused(settings, message):
    with pytest.raises(AlightError, match=message):
        simulate_batch(BASE, masses(), channels=["q"], **settings)


def test_a_recording_that_no_memory_holds_is_refused_with_what_would_be_right():
    with pytest.raises(AlightError, match=r"needs .* GB, and this machine has .* GB; record fewer"):
        simulate_batch(BASE, masses(10**6), channels=["q", "F_m", "tau"])


class Plain(alight.control.PlainLaw):
    """A law in ordinary Python."""

    def initial_state(self) -> dict[str, Any]:
        return {}

    def tick(self, state: Any, measured: Any, dt: Any) -> Any:
        return alight.control.Tick(np.zeros(2), {}, {})


def test_a_law_in_plain_python_is_refused():
    with pytest.raises(AlightError, match=r"plain Python runs in no batch; use alight\.simulate"):
        simulate_batch(BASE.with_law(Plain()), masses())
