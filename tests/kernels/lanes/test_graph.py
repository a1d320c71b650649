"""Rewrites save work and keep values; the schedule holds each needed node once, in order."""

from __future__ import annotations

from collections import Counter

import casadi as ca
import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from alight.kernels.lanes.graph import Graph, depends, graph_of, inputs_of, pruned, simplified
from alight.kernels.lanes.schedule import scheduled
from alight.scenarios import load_scenario
from alight.simulation.closed_loop import tick_program
from tests.kernels.lanes.drivers import RUNS
from tests.kernels.lanes.expressions import (
    INPUTS,
    NUMBERS,
    PARAMETERS,
    covering,
    evaluated,
    random_function,
)

SEEDS = st.integers(0, 10**6)


def inputs(seed: int) -> list[np.ndarray]:
    rng = np.random.default_rng(seed)
    return [rng.uniform(-20, 20, (rows, RUNS)) for rows in (INPUTS, 1, NUMBERS)]


def assert_same_values(before: Graph, after: Graph, seed: int) -> None:
    old, new = (evaluated(graph, inputs(seed), seed) for graph in (before, after))
    clear = ~(old.doubtful | new.doubtful)
    assert np.all(abs(old.exact - new.exact)[:, clear] <= old.tolerance[:, clear])


def cost(graph: Graph) -> Counter[str]:
    return Counter(node.op for node in graph.nodes)


@given(SEEDS)
def test_a_graph_says_what_its_function_says(seed):
    function, given_ = random_function(seed), inputs(seed)
    told = evaluated(graph_of(function), given_, seed)
    expected = np.vstack([np.asarray(v) for v in function(*given_)])
    clear = ~told.doubtful
    assert np.all(abs(told.exact - expected)[:, clear] <= told.tolerance[:, clear])


@given(SEEDS)
def test_simplification_changes_no_value_beyond_rounding(seed):
    graph = graph_of(random_function(seed))
    assert_same_values(graph, simplified(graph, PARAMETERS), seed)


def test_simplification_changes_the_value_of_no_single_operation():
    for seed, function in enumerate(covering(0)):
        graph = graph_of(function)
        assert_same_values(graph, simplified(graph, PARAMETERS), seed)


@given(SEEDS)
def test_simplification_leaves_nothing_that_no_output_needs(seed):
    graph = simplified(graph_of(random_function(seed)), PARAMETERS)
    assert pruned(graph).nodes == graph.nodes
    assert len(set(graph.nodes)) == len(graph.nodes)
    assert all(a < i for i, node in enumerate(graph.nodes) for a in node.args)


@given(SEEDS, st.data())
def test_the_schedule_holds_each_needed_node_once_and_after_its_arguments(seed, data):
    graph = simplified(graph_of(random_function(seed)), PARAMETERS)
    dropped = data.draw(st.sets(st.integers(0, len(graph.nodes) - 1)))
    needed = [i for i in range(len(graph.nodes)) if i not in dropped]
    order = scheduled(graph.nodes, needed)
    place = {i: k for k, i in enumerate(order)}
    assert sorted(order) == needed
    assert all(place[a] < place[i] for i in needed for a in graph.nodes[i].args if a not in dropped)


def test_a_division_by_what_a_run_keeps_costs_a_product_and_a_shared_one_is_made_once():
    x, p = ca.SX.sym("x", 3), ca.SX.sym("p", 1)
    function = ca.Function(
        "f", [x, ca.SX(0, 1), p], [ca.vertcat(x[0] / p, x[1] / p, x[0] / x[2], x[1] / x[2], x / 8)]
    )
    made = cost(simplified(graph_of(function), PARAMETERS))
    assert made["div"] == 0 and made["inv"] == 2


def test_sines_of_sums_are_made_of_those_of_the_terms():
    q = ca.SX.sym("q", 2)
    outputs = ca.vertcat(ca.sin(q), ca.cos(q[0] + q[1]), ca.sin(q[0] + q[1] + 0.01 * q[0]))
    made = cost(simplified(graph_of(ca.Function("f", [q], [outputs])), PARAMETERS))
    assert made["sin"] + made["turned_sin"] <= 4 and made["turned_cos"] == 0


def test_choices_become_one_operation_each_and_masks_stay_masks():
    a, b = ca.SX.sym("a"), ca.SX.sym("b")
    inner = ca.if_else(a < b, 1.0, 0.0)
    function = ca.Function("f", [a, b], [ca.if_else(inner > 0, a, b)])
    made = cost(simplified(graph_of(function), PARAMETERS))
    assert made == Counter(input=2, lt=1, select=1)


def test_what_depends_on_parameters_alone_is_told_from_what_changes():
    function = random_function(5)
    graph = graph_of(function)
    changing = depends(graph, [0, 1])
    for i, node in enumerate(graph.nodes):
        if node.op == "input":
            assert changing[i] == (node.value[0] != PARAMETERS)
        else:
            assert changing[i] == any(changing[a] for a in node.args)
    assert inputs_of(graph) <= {0, 1, PARAMETERS}


def test_the_tick_of_the_paper_gets_cheaper():
    loop = load_scenario("experiment-1").closed_loop
    before = graph_of(tick_program(loop, ("F_m", "e_m"), loop.zeros()).usual)
    was, now = cost(before), cost(simplified(before, PARAMETERS))
    assert now["div"] < was["div"] / 3
    assert now["sin"] + now["cos"] < (was["sin"] + was["cos"]) / 3
    assert now["if_else_zero"] < was["if_else_zero"] / 2
