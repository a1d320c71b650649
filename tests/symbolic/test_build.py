"""`build` refuses the graphs that would give wrong numbers silently."""

from __future__ import annotations

import math

import casadi as ca
import numpy as np
import pytest
from hypothesis import given

from alight.errors import AlightError, ExpressionError
from alight.symbolic import ops
from alight.symbolic.build import build
from tests.strategies import vectors

X = ca.SX.sym("x", 2)


@pytest.mark.parametrize("constant", [np.nan, np.inf, -np.inf])
def test_constants_that_are_not_finite_are_refused(constant):
    for expression in (X[0] * constant, ca.SX(constant), ca.if_else(X[0] > 0, X[1], constant)):
        with pytest.raises(ExpressionError, match="not finite") as refusal:
            build("wrong", {"x": X}, {"y": expression})
        assert "wrong" in str(refusal.value) and "alight.symbolic.ops" in str(refusal.value)


def test_the_mistake_behind_it_is_refused():
    """``math`` turns an expression into NaN without a word."""
    with pytest.raises(ExpressionError, match="not finite"):
        build("mistake", {"x": X}, {"y": X[0] + math.sin(X[1])})


def test_symbols_that_are_no_input_are_refused_by_name():
    gain, unused = ca.SX.sym("gain"), ca.SX.sym("unused")
    with pytest.raises(ExpressionError, match="depends on gain, which is no input"):
        build("free", {"x": X, "unused": unused}, {"y": gain * X[0]})


def test_a_symbol_of_the_same_name_is_not_the_same_symbol():
    with pytest.raises(ExpressionError, match="depends on x, which is no input"):
        build("namesake", {"x": ca.SX.sym("x")}, {"y": 2 * ca.SX.sym("x")})


def test_its_errors_are_those_of_alight_and_value_errors():
    assert issubclass(ExpressionError, AlightError) and issubclass(AlightError, ValueError)


@given(vectors(2, 5.0))
def test_values_names_and_shapes_are_those_of_the_expressions(x):
    shared = ops.sin(X[0]) * ops.exp(X[1])
    function = build(
        "named", {"x": X}, {"scalar": shared, "matrix": ops.matrix([[shared, 0.0], [X[1], shared]])}
    )
    assert function.name_in() == ["x"] and function.name_out() == ["scalar", "matrix"]
    value = np.sin(x[0]) * np.exp(x[1])
    scalar, matrix = (v.full() for v in function(x))
    np.testing.assert_allclose(scalar, [[value]], rtol=1e-14)
    np.testing.assert_allclose(matrix, [[value, 0.0], [x[1], value]], rtol=1e-14)


def test_common_subexpressions_are_computed_once():
    once = build("once", {"x": X}, {"y": ops.sin(X[0] * X[1])})
    thrice = build("thrice", {"x": X}, {"y": ca.vertcat(*(ops.sin(X[0] * X[1]) for _ in range(3)))})
    sines = [
        sum(f.instruction_id(i) == ca.OP_SIN for i in range(f.n_instructions()))
        for f in (once, thrice)
    ]
    assert sines == [1, 1]


def test_outputs_are_dense_so_that_columns_never_move():
    function = build("sparse", {"x": X}, {"y": ca.vertcat(X[0], ca.SX(1, 1), X[1])})
    assert function.nnz_out(0) == 3
