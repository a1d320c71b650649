"""A batch of a scenario is its runs one by one, in less time and in bounded memory."""

from __future__ import annotations

import json
import subprocess
import sys
from functools import cache
from typing import Any

import numpy as np
import pytest

import alight
from alight.scenarios import load_scenario, simulate_batch
from alight.scenarios.scenario import Scenario
from alight.scenarios.simulate_batch import Batch
from alight.simulation.metrics import METRICS, steady_first
from tests.cli.command import environment
from tests.compiler import NEEDS_COMPILER
from tests.simulation.figures import expected

NEAR: dict[str, Any] = {"start.x_r": [0.196, 0.37], "duration": 1.0, "steady_state": 0.2}
"""Close before the body, so that a second is enough to settle."""
CALM = {"law.gains.alpha1": 10.0, "law.gains.alpha3": 1.0}
HERTZ = {"type": "hunt-crossley", "K_I": 3e6, "exponent": 1.5, "dissipation": 1.0}
SPRING = {"type": "linear-spring", "K_I": 110451.0}
EXACT = {"law.type": "exact-model", "law.gains.k3": [20.0, 1.0], "testbed.delay": True}
SMOOTH = {"plant.tip_friction.mu": 0.0}
SETTLED: dict[str, tuple[str, dict[str, Any]]] = {
    "force-limiting, Hunt-Crossley, friction, noise": (
        "experiment-1",
        {**NEAR, **CALM, "plant.contact": HERTZ},
    ),
    "exact model, Kelvin-Voigt, delay": ("experiment-1", {**NEAR, **CALM, **EXACT, **SMOOTH}),
    "unsaturated, linear spring, artificial limits": (
        "experiment-2",
        {**NEAR, **SMOOTH, "plant.contact": SPRING, "plant.body.damping": 20.0},
    ),
}
"""All laws, all contact laws, with and without friction, delay and artificial limits."""
RUNS = 5
CHANNELS = ("q", "x_m", "F_m", "tau")
ROUNDING = 1e-8
"""How far a run of a batch may lie from the single run, relative to a signal's largest value.

Rounding differs and grows through the impact, to 1e-11 here, as long as no measured value comes to
lie on the other side of a quantiser's step; where one does, in a run of many, it grows to `STEP`.
"""
STEP = 1e-2


@cache
def numbers(case: str) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(len(case))
    near = rng.uniform(0.98, 1.02, (4, RUNS))
    scenario = settled(case)
    return {
        "plant.body.m": scenario.plant.body.m * near[0],
        "plant.contact.K_I": scenario.plant.contact.K_I * near[1],
        "law.gains.k3": np.array(scenario.law.gains.k3) * near[2][:, None],
        "target.x_md": 0.206 + 0.03 * near[3],
        "seed": np.arange(RUNS) + 7,
    }


@cache
def settled(case: str) -> Scenario:
    name, settings = SETTLED[case]
    return load_scenario(name, settings)


@cache
def batch(case: str) -> Batch:
    return simulate_batch(settled(case), numbers(case), channels=CHANNELS, every=3, threads=2)


def one(case: str, i: int) -> alight.Recording:
    name, settings = SETTLED[case]
    values = {path: v[i].tolist() for path, v in numbers(case).items()}
    return alight.simulate(load_scenario(name, {**settings, **values}), backend="vm")


CASES = pytest.mark.parametrize("case", SETTLED)


@NEEDS_COMPILER
@CASES
def test_settled_runs_are_those_of_the_scenarios_loaded_one_by_one(case):
    found = batch(case)
    apart: dict[str, list[float]] = {name: [] for name in (*METRICS, *CHANNELS)}
    for i in range(RUNS):
        alone = one(case, i)
        assert alone.verdict.completed and found.verdict(i) == alone.verdict
        assert alone["F_m"][-400:].min() > 1.0  # at rest against the body
        for name in CHANNELS:
            value = alone[name][::3]
            apart[name].append(abs(found[name][i] - value).max() / abs(value).max())
        scenario = settled(case)
        told = expected(
            {name: alone[name] for metric in METRICS.values() for name in metric.needs},
            dt=scenario.closed_loop.dt,
            first=steady_first(len(alone), scenario.closed_loop.dt, scenario.document.steady_state),
            travel=numbers(case)["target.x_md"][i] - scenario.plant.body.x_0,
        )
        assert told.keys() == found.metrics.keys()
        for name, value in told.items():
            size = np.max(np.abs(value)) or 1.0
            apart[name].append(float(np.max(np.abs(found[name][i] - value)) / size))
    for name, distances in apart.items():
        assert max(distances) <= STEP and np.median(distances) <= ROUNDING, (name, distances)


@NEEDS_COMPILER
@pytest.mark.slow
@CASES
def test_in_every_width_and_order_on_one_thread_and_more(case):
    found, varied = batch(case), numbers(case)
    order = np.random.default_rng(0).permutation(RUNS)
    for width in (1, 2, 4, 8):
        asked: dict[str, Any] = {"channels": CHANNELS, "every": 3, "width": width}
        once = simulate_batch(settled(case), varied, threads=1, **asked)
        twice = simulate_batch(settled(case), varied, threads=2, **asked)
        turned = {path: values[order] for path, values in varied.items()}
        other = simulate_batch(settled(case), turned, threads=2, **asked)
        for name in (*METRICS, *CHANNELS):
            assert np.array_equal(once[name], twice[name])
            assert np.array_equal(once[name][order], other[name])
            scale = abs(found[name]).max() or 1.0
            apart = abs(once[name] - found[name]).reshape(RUNS, -1).max(axis=1) / scale
            assert max(apart) <= STEP and np.median(apart) <= ROUNDING, name


def test_a_batch_tells_what_varied_with_units_times_and_outcomes():
    scenario = load_scenario("experiment-1", {"duration": 0.01, "steady_state": 0.005})
    masses = np.array([1.7, 1.8])
    found = simulate_batch(
        scenario,
        {"plant.body.m": masses, "law.gains.k3": [[90.0, 5.0], [95.0, 5.0]], "seed": [3, 4]},
        metrics=["peak_F_m", "peak_tau"],
        channels=["x_m", "q"],
        every=3,
        backend="vm",
    )
    assert len(found) == 2 and found.completed.all()
    assert np.allclose(found.t, np.arange(0, 20, 3) / 2000, rtol=1e-12)
    assert found["x_m"].shape == (2, 7) and found["q"].shape == (2, 7, 2)
    assert found["peak_tau"].shape == (2, 2) and list(found.metrics) == ["peak_F_m", "peak_tau"]
    assert found.units == {"peak_F_m": "N", "peak_tau": "N m", "q": "rad", "x_m": "m"}
    assert np.allclose(found.end, 19 / 2000, rtol=1e-12)
    assert found.verdict(1) == alight.simulate(scenario, backend="vm").verdict
    assert np.array_equal(found.varied["plant.body.m"], masses)
    with pytest.raises(alight.errors.UnknownName, match="unknown metric or channel 'F_m'; one of"):
        found["F_m"]
    table = found.to_pandas()
    assert table.columns[:4].tolist() == ["plant.body.m", "law.gains.k31", "law.gains.k32", "seed"]
    assert table["outcome"].tolist() == ["COMPLETED"] * 2 and table["seed"].tolist() == [3, 4]


@pytest.mark.parametrize("backend", ["vm", pytest.param("c", marks=NEEDS_COMPILER)])
def test_runs_that_trip_say_so_with_time_and_cause_of_the_single_run(backend):
    settings = {"law.gains.alpha1": 5000.0, "duration": 1.0, "steady_state": 0.2}
    scenario = load_scenario("experiment-1", settings)
    stiff = np.array([5000.0, 10.0])
    varied = {"law.gains.alpha1": stiff}
    found = simulate_batch(
        scenario, varied, metrics=["peak_F_m"], channels=["u_f"], backend=backend, width=2
    )
    for i in range(2):
        alone = load_scenario("experiment-1", {**settings, "law.gains.alpha1": stiff[i]})
        recording = alight.simulate(alone, backend="vm")
        assert found.verdict(i) == recording.verdict
        assert np.isfinite(found["u_f"][i]).sum() == len(recording)
    assert found.completed.tolist() == [False, True]


# Without a compiler

BARE = """
import json, sys, warnings
import numpy as np
from alight.scenarios import load_scenario, simulate_batch
scenario = load_scenario("experiment-1", {"duration": 0.05, "steady_state": 0.01})
with warnings.catch_warnings(record=True) as told:
    warnings.simplefilter("always")
    found = [
        simulate_batch(scenario, {"plant.body.m": [1.7, 1.8]}, metrics=metrics)
        for metrics in (None, ["peak_tau"])
    ]
figures = {name: np.asarray(v).tolist() for name, v in found[0].metrics.items()}
print(json.dumps({"told": [str(w.message) for w in told], "figures": figures}))
"""


def test_without_a_compiler_a_batch_gives_the_same_and_one_warning():
    bare = environment(CC="/nowhere/cc", PATH="")
    done = subprocess.run(
        [sys.executable, "-c", BARE], env=bare, capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr
    said = json.loads(done.stdout)
    assert len(said["told"]) == 1
    assert said["told"][0].startswith("a batch runs in CasADi's virtual machine, a thousand times")
    assert "CC=/nowhere/cc is no program on the path" in said["told"][0]
    scenario = load_scenario("experiment-1", {"duration": 0.05, "steady_state": 0.01})
    here = simulate_batch(scenario, {"plant.body.m": [1.7, 1.8]}, backend="vm")
    for name, values in here.metrics.items():
        assert np.array_equal(values, said["figures"][name]), name


def test_that_c_alone_is_wanted_is_not_passed_over(monkeypatch):
    monkeypatch.setenv("CC", "/nowhere/cc")
    scenario = load_scenario("experiment-1", {"duration": 0.015, "steady_state": 0.01})
    with pytest.raises(alight.kernels.CompilerUnavailable, match="is no program on the path"):
        simulate_batch(scenario, {"plant.body.m": [1.7]}, metrics=["impulse"], backend="c")


# Memory

MEASURED = """
import json, resource, sys
import numpy as np
from alight.scenarios import load_scenario, simulate, simulate_batch

def run(runs, duration):
    settings = {"duration": duration, "steady_state": duration / 4}
    scenario = load_scenario("experiment-1", settings)
    varied = {"plant.body.m": np.linspace(1.75, 1.85, runs), "seed": np.arange(runs)}
    return simulate_batch(scenario, varied, metrics=["peak_tau", "settling"])

def memory():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024

runs, duration = int(sys.argv[1]), float(sys.argv[2])
run(16, 0.02)
before = memory()
if len(sys.argv) > 3:  # no more memory than that, threads' stacks included
    import os, pathlib
    now = int(pathlib.Path("/proc/self/statm").read_text().split()[0]) * os.sysconf("SC_PAGE_SIZE")
    resource.setrlimit(resource.RLIMIT_AS, (now + int(sys.argv[3]),) * 2)
found = run(runs, duration)
grown, apart = memory() - before, []
for i in (0, runs // 3, runs - 1) if duration < 1 else ():
    mass = float(found.varied["plant.body.m"][i])
    alone = load_scenario(
        "experiment-1", {"duration": duration, "steady_state": duration / 4, "plant.body.m": mass}
    )
    peak = abs(simulate(alone, seed=i, channels=("tau",))["tau"]).max(axis=0)
    apart.append(float(np.max(abs(found["peak_tau"][i] / peak - 1))))
print(json.dumps({
    "grown": grown,
    "apart": max(apart, default=None),
    "completed": int(found.completed.sum()),
    "numbers": sum(v.nbytes for v in found.metrics.values()) / len(found) / 8,
}))
"""


def measured(*arguments: object) -> dict[str, Any]:
    command = [sys.executable, "-c", MEASURED, *map(str, arguments)]
    done = subprocess.run(command, env=environment(), capture_output=True, text=True, timeout=900)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@NEEDS_COMPILER
@pytest.mark.skipif(sys.platform != "linux", reason="ru_maxrss is in kilobytes on Linux")
def test_memory_does_not_grow_with_the_number_of_ticks():
    ticks = 100_000
    long = measured(8, ticks / 2000)
    assert long["completed"] == 8
    noise = 8 * 4096 * 8 * 2  # what is drawn at a time, for both threads
    assert long["grown"] < 4 * noise + 4e6
    assert long["grown"] < 8 * ticks * 8  # not even one number for each tick


@NEEDS_COMPILER
@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_a_million_runs_fit_into_memory():
    runs = 1_000_000
    found = measured(runs, 0.02, 1_500_000_000)
    assert found["completed"] == runs
    assert found["numbers"] == 3  # two peaks and a settling time for each run
    assert found["grown"] < 1.2e9
    assert found["apart"] < 1e-6  # peaks are those of the single runs
