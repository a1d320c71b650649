"""The plain C with all features does what Alight does, but for its steps at the switch."""

from __future__ import annotations

import numpy as np
import pytest

import alight
from alight.kernels.lanes.graph import Graph
from alight.scenarios.simulate_batch import simulate_batch
from alight_benchmarks.generated import NoCompiler
from alight_benchmarks.own import plain
from alight_benchmarks.own.floor import Cost, count, usual_graph
from alight_benchmarks.own.problems import full, ideal

CHANNELS = ("q", "x_m", "q_dot_measured")
FREE = 0.03
"""Ends before the first contact of experiment 1 [s]."""


def prepared(*args, **options) -> plain.PlainC:
    try:
        return plain.prepared(*args, **options)
    except NoCompiler as missing:
        pytest.skip(str(missing))


def test_with_sensors_and_noise_it_follows_alight_in_free_motion():
    scenario = full(FREE, substeps=4)
    rows = prepared(scenario, channels=CHANNELS).call()
    run = alight.simulate(scenario, channels=CHANNELS, backend="vm")
    np.testing.assert_allclose(rows, run.samples, rtol=0, atol=2e-9)


def test_its_metrics_are_those_of_a_batch():
    scenario = ideal(0.2)
    made = prepared(scenario, metrics=True)
    made.call()
    batch = simulate_batch(
        scenario, {"plant.body.m": np.array([scenario.plant.body.m])}, backend="vm"
    )
    assert batch["peak_F_m"][0] > 1.0
    # peak force, then impulse over dt, then separations: the order of METRICS
    assert made.memory[0] == pytest.approx(batch["peak_F_m"][0], rel=1e-3)
    assert made.memory[1] * scenario.closed_loop.dt == pytest.approx(batch["impulse"][0], rel=1e-3)
    assert made.memory[2] == batch["separations"][0]


def test_operations_are_counted_once_for_each_value_and_pair():
    graph = Graph()
    x = graph.add("input", value=(0, 0))
    p = graph.add("input", value=(2, 0))
    once = graph.add("mul", p, p)  # of the parameters alone
    sine, cosine = graph.add("sin", x), graph.add("cos", x)
    product = graph.add("mul", sine, cosine)
    total = graph.add("add", product, graph.add("tanh", once))
    graph.outputs = [[graph.add("fmax", total, x)]]
    found = count(graph)
    assert (found["arithmetic"], found["functions"], found["choices"]) == (2, {"sincos": 1}, 1)
    assert found["operations"] == 2 + Cost(17, 5).operations
    assert found["flops"] == 2 + Cost(17, 5).flops


def test_every_operation_of_the_shipped_tick_has_a_cost():
    for scenario in (ideal(), full()):
        found = count(usual_graph(scenario.closed_loop))
        assert 500 < found["operations"] < found["flops"] < 10_000
