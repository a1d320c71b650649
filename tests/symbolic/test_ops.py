"""The functions of `alight.symbolic.ops`: one meaning for floats, arrays and expressions."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from alight.symbolic import ops
from tests.strategies import between, vectors

ANY = between(-50.0, 50.0)
ONE = {
    "sin": ANY,
    "cos": ANY,
    "tanh": ANY,
    "exp": ANY,
    "log1p": between(-0.99, 50.0),
    "sqrt": between(0.0, 50.0),
    "floor": ANY,
    "fabs": ANY,
    "sign": ANY,
    "log_cosh": between(-1e5, 1e5),
}
"""Functions of one argument, and where they are defined."""


def symbolic_value(function: Any, *values: Any) -> np.ndarray:
    """Value of a function through an expression graph."""
    symbols = [ca.SX.sym(f"x{i}", *np.shape(np.atleast_1d(v))) for i, v in enumerate(values)]
    result = ca.Function("f", symbols, [ca.SX(function(*symbols))])(*values)
    return np.squeeze(result.full())


@pytest.mark.parametrize("name", list(ONE))
@given(data=st.data())
def test_floats_arrays_and_expressions_give_the_same_numbers(name, data):
    function = getattr(ops, name)
    values = np.array(data.draw(st.lists(ONE[name], min_size=2, max_size=5)))
    array = function(values)
    assert array.shape == values.shape
    # The mathematics libraries behind the three differ by rounding.
    np.testing.assert_allclose([function(float(v)) for v in values], array, rtol=1e-14, atol=1e-15)
    np.testing.assert_allclose(symbolic_value(function, values), array, rtol=1e-14, atol=1e-15)


@given(ANY, ANY)
def test_extremes_and_choice_agree(a, b):
    for function, expected in (
        (ops.maximum, max(a, b)),
        (ops.minimum, min(a, b)),
        (lambda x, y: ops.where(x > y, x, 2 * y), a if a > b else 2 * b),
    ):
        assert function(a, b) == expected
        assert function(np.array([a]), np.array([b])).tolist() == [expected]
        assert symbolic_value(function, a, b) == expected
        assert np.ndim(function(a, b)) == 0


def test_a_choice_that_is_decided_leaves_nothing_of_the_other_branch():
    x, y = ca.SX.sym("x"), ca.SX.sym("y")
    assert ops.where(True, x, y) is x and ops.where(np.False_, x, y) is y
    assert ops.where(1.0 > 2.0, x, 0.0) == 0.0
    chosen = ops.where(x > 0, x, y)
    assert {s.name() for s in ca.symvar(chosen)} == {"x", "y"}


@given(vectors(4, 5.0), vectors(2, 5.0))
def test_vectors_and_matrices_agree(entries, other):
    def square(x: Any) -> Any:
        return ops.matrix([[x[0] + 20.0, x[1]], [x[2], x[3] + 20.0]])

    functions = (
        lambda x, y: ops.vector(x[0], y[1], 3.0),
        lambda x, y: ops.concatenate(x, y[0], y),
        lambda x, y: square(x),
        lambda x, y: ops.inverse(square(x)),
        lambda x, y: ops.determinant(square(x)),
        lambda x, y: square(x) @ y,
        lambda x, y: ops.dot(x[:2], y),
        lambda x, y: ops.total(x),
    )
    for function in functions:
        numeric = function(entries, other)
        symbolic = symbolic_value(function, entries, other)
        np.testing.assert_allclose(symbolic, numeric, rtol=1e-12, atol=1e-12)


def test_nothing_joined_to_nothing_is_a_vector_without_entries():
    assert ops.concatenate().shape == (0,) and ops.concatenate().dtype == float
    assert ops.concatenate(np.zeros(0), 1.0, np.zeros(0)).tolist() == [1.0]
    joined = ops.concatenate(ca.SX(0, 1), ca.SX.sym("x"))
    assert joined.shape == (1, 1)


@given(vectors(4, 5.0))
def test_inverse_and_determinant_are_those_of_a_matrix(entries):
    a = np.array([[entries[0] + 20.0, entries[1]], [entries[2], entries[3] + 20.0]])
    np.testing.assert_allclose(ops.inverse(a) @ a, np.eye(2), atol=1e-13)
    assert ops.determinant(a) == pytest.approx(a[0, 0] * a[1, 1] - a[0, 1] * a[1, 0], rel=1e-12)


def test_vectors_come_from_tuples_arrays_and_expressions():
    x = ca.SX.sym("x")
    assert ops.as_vector((1.0, 2.0)).tolist() == [1.0, 2.0]
    assert ops.as_vector(np.array([1.0, 2.0])).tolist() == [1.0, 2.0]
    assert ops.as_vector(ca.vertcat(x, x)).shape == (2, 1)
    assert ops.as_vector((x, 2.0)).shape == (2, 1)
    assert ops.as_expression(x) is x
    assert (ca.evalf(ops.as_expression([1.0, 2.0])).full()[:, 0] == [1.0, 2.0]).all()


def test_what_holds_an_expression_is_symbolic():
    x = ca.SX.sym("x")
    assert ops.is_symbolic(x) and ops.is_symbolic((1.0, [x])) and ops.is_symbolic(1.0, x)
    assert not ops.is_symbolic(1.0, np.ones(2), (1.0, [2.0]), None)


# log_cosh


@pytest.mark.parametrize("x", [1e5, -1e5, 1e300, -1e300])
def test_log_cosh_does_not_overflow(x):
    expected = abs(x) - np.log(2.0)
    assert ops.log_cosh(x) == expected
    assert symbolic_value(ops.log_cosh, x) == expected


@given(between(-700.0, 700.0))
def test_log_cosh_is_the_logarithm_of_cosh(x):
    assert ops.log_cosh(x) == pytest.approx(np.log(np.cosh(x)), rel=1e-14, abs=1e-15)


@given(between(-30.0, 30.0))
def test_the_slope_of_log_cosh_is_tanh(x):
    symbol = ca.SX.sym("x")
    slope = ca.Function("slope", [symbol], [ca.gradient(ops.log_cosh(symbol), symbol)])
    if x != 0:
        assert float(slope(x)) == pytest.approx(np.tanh(x), rel=1e-13, abs=1e-15)
