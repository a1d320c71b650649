"""Straight-line C over lanes gives what CasADi gives, in every width and every lane."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from alight.errors import ExpressionError
from alight.kernels.lanes.emit import Names, body, kept
from alight.kernels.lanes.graph import Graph, graph_of, simplified
from tests.compiler import NEEDS_COMPILER
from tests.kernels.lanes.drivers import RUNS, WIDTHS, call, driver, library, same
from tests.kernels.lanes.expressions import (
    INPUTS,
    NO_NUMBER_SAFE,
    NUMBERS,
    PARAMETERS,
    covering,
    evaluated,
    random_function,
)

pytestmark = NEEDS_COMPILER

EVERY_WIDTH = pytest.mark.parametrize("width", WIDTHS)
FUNCTIONS = covering(40)
STRANGE = [random_function(seed, NO_NUMBER_SAFE, size=9) for seed in range(1000, 1024)]
NOT_TAME = [0.0, 1.0, -1.5, 1e9, np.inf, -np.inf, np.nan]
NUMBER = st.floats(-20, 20).map(lambda v: v if abs(v) > 1e-100 else 0.0)
"""Of numbers whose squares and roots leave the range of doubles nothing is said."""
TICK = arrays(np.float64, (INPUTS + 1, RUNS), elements=NUMBER)
RUN = arrays(np.float64, (NUMBERS, RUNS), elements=NUMBER)


def lines_of(function: ca.Function) -> list[str]:
    """A function as the batch writes it: what depends on parameters alone is made beforehand."""
    graph = simplified(graph_of(function), PARAMETERS)
    once = kept(graph, PARAMETERS)
    inputs = {0: "x[{0}]", 1: f"x[{INPUTS}]", PARAMETERS: "v_load(p + {0} * LANES)"}
    made = body(Graph(graph.nodes, [once]), Names(inputs, {0: "h[{0}]"}))
    outputs = {0: "out[0]", 1: "(out + 1)[{0}]"}
    given_ = {i: f"h[{entry}]" for entry, i in enumerate(once)}
    tick = body(graph, Names(inputs, outputs), given_)
    return [f"V h[{len(once) + 1}];", "{", *made, "}", "(void)h;", *tick]


def source(functions: Sequence[ca.Function]) -> str:
    return driver({function.name(): lines_of(function) for function in functions})


UNSHRUNK = (Phase.reuse, Phase.generate)
"""An example holds every function: to shrink it would take minutes."""

TAME_SOURCE = source(FUNCTIONS)
STRANGE_SOURCE = source(STRANGE)


def emitted(text: str, function: ca.Function, width: int, x, p) -> np.ndarray:
    outputs = 1 + function.numel_out(1)
    return call(library(text, width), function.name(), width, x, p, outputs)


def casadi_says(function: ca.Function, x: np.ndarray, p: np.ndarray) -> np.ndarray:
    """One call for all columns: CasADi maps over them."""
    return np.vstack([np.asarray(v) for v in function(x[:INPUTS], x[INPUTS:], p)])


@settings(max_examples=3, phases=UNSHRUNK)
@given(x=TICK, p=RUN)
def test_every_operation_and_random_functions_of_them_agree_with_casadi(x, p):
    told = 0
    for function in FUNCTIONS:
        expected = casadi_says(function, x, p)
        bound = evaluated(graph_of(function), [x[:INPUTS], x[INPUTS:], p])
        clear = ~bound.doubtful
        told += clear.sum()
        for width in WIDTHS:
            got = emitted(TAME_SOURCE, function, width, x, p)
            assert np.all(abs(got - expected)[:, clear] <= bound.tolerance[:, clear]), function
    assert told > len(FUNCTIONS)


def test_most_of_what_is_compared_is_compared_tightly():
    rng = np.random.default_rng(0)
    x, p = rng.uniform(-20, 20, (INPUTS + 1, RUNS)), rng.uniform(-20, 20, (NUMBERS, RUNS))
    bounds = [evaluated(graph_of(f), [x[:INPUTS], x[INPUTS:], p]) for f in FUNCTIONS]
    widths = [b.tolerance / (1 + abs(b.exact)) for b in bounds]
    assert np.mean([b.doubtful.mean() for b in bounds]) < 0.02
    assert np.median(np.concatenate([w.ravel() for w in widths])) < 1e-13
    assert np.quantile(np.concatenate([w.ravel() for w in widths]), 0.95) < 1e-10


@EVERY_WIDTH
@given(x=TICK, p=RUN, strange=st.sampled_from(NOT_TAME), lane=st.integers(0, RUNS - 1))
def test_a_lane_does_not_see_its_neighbours(width, x, p, strange, lane):
    others = np.arange(RUNS) != lane
    x_other, p_other = (np.where(others, strange, v) for v in (x, p))
    for function in FUNCTIONS[::4]:
        got = emitted(TAME_SOURCE, function, width, x, p)
        beside = emitted(TAME_SOURCE, function, width, x_other, p_other)
        assert same(got[:, lane], beside[:, lane]), function


@settings(max_examples=6, phases=UNSHRUNK)
@given(x=TICK, p=RUN, at=st.lists(st.integers(0, INPUTS), min_size=1, max_size=3), data=st.data())
def test_infinity_and_nan_take_the_way_that_they_take_in_casadi(x, p, at, data):
    for entry in at:
        x[entry] = data.draw(arrays(np.float64, RUNS, elements=st.sampled_from(NOT_TAME)))
    for function in STRANGE:
        expected = casadi_says(function, x, p)
        bound = evaluated(graph_of(function), [x[:INPUTS], x[INPUTS:], p])
        clear = ~bound.doubtful
        finite = np.isfinite(bound.tolerance) & np.isfinite(expected) & clear
        for width in WIDTHS:
            got = emitted(STRANGE_SOURCE, function, width, x, p)
            assert np.array_equal(np.isnan(got[:, clear]), np.isnan(expected[:, clear])), function
            assert np.all(abs(got[finite] - expected[finite]) <= bound.tolerance[finite]), function


ODD = {
    "erfinv": lambda x: ca.erfinv(x / 100),
    "printme": lambda x: x.printme(1),
}


@pytest.mark.parametrize("name", ODD)
def test_an_operation_without_a_form_is_refused_by_name(name):
    x, p = ca.SX.sym("x"), ca.SX.sym("p", 0)
    graph = graph_of(ca.Function("odd", [x, p], [ODD[name](x) + 1]))
    with pytest.raises(ExpressionError, match=f"the operation '{name}' has no form for lanes"):
        body(graph, Names({0: "x[{0}]"}, {0: "out[{0}]"}))


def test_a_function_that_is_not_of_scalars_or_leaves_zeros_out_is_refused():
    m, x = ca.MX.sym("m", 2), ca.SX.sym("x", 2)
    with pytest.raises(ExpressionError, match="only functions of SX"):
        graph_of(ca.Function("matrices", [m], [2 * m]))
    with pytest.raises(ExpressionError, match="must be dense"):
        graph_of(ca.Function("sparse", [x], [ca.diag(x)]))
