"""Derivatives that nobody types: right where they are defined, refused where they would lie."""

from __future__ import annotations

from typing import Annotated, Any

import casadi as ca
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from alight.errors import ExpressionError
from alight.symbolic import ops
from alight.symbolic.derive import evaluated, jacobian, regressor, time_derivative, traced
from alight.symbolic.parameters import Quantity, lift, parameters, values_of
from tests.strategies import between, vectors

XS = vectors(2, 3.0)


@parameters
class Wave:
    amplitude: Annotated[float, Quantity("m", "size of the wave")] = 2.0
    slope: Annotated[tuple[float, float], Quantity("1/m", "rise along both axes")] = (0.5, -1.0)

    def height(self, x: Any) -> Any:
        slope = ops.as_vector(self.slope)
        return ops.vector(
            self.amplitude * ops.sin(x[0]) * x[1], ops.exp(slope[0] * x[0] + slope[1] * x[1]), 7.0
        )

    def height_jacobian(self, x: np.ndarray) -> np.ndarray:
        growth = np.exp(np.dot(self.slope, x))
        return np.array(
            [
                [self.amplitude * np.cos(x[0]) * x[1], self.amplitude * np.sin(x[0])],
                [self.slope[0] * growth, self.slope[1] * growth],
                [0.0, 0.0],
            ]
        )


WAVE = Wave()


@given(XS)
def test_the_jacobian_is_the_matrix_of_partial_derivatives(x):
    np.testing.assert_allclose(jacobian(WAVE.height, x), WAVE.height_jacobian(x), rtol=1e-13)


@given(XS, between(-3.0, 3.0))
def test_a_traced_function_runs_its_body_once_and_gives_its_values_everywhere(x, scale):
    calls = []

    def function(point: Any, factor: Any) -> Any:
        calls.append(point)
        return factor * WAVE.height(point)

    once, symbol = traced(function, 2, 1), ca.SX.sym("x", 2)
    expected = scale * WAVE.height(x)
    np.testing.assert_allclose(once(x, scale), expected, rtol=1e-14, atol=1e-14)
    placed = ca.Function("placed", [symbol], [once(symbol, scale)])
    np.testing.assert_allclose(placed(x).full()[:, 0], expected, rtol=1e-14, atol=1e-14)
    assert len(calls) == 1
    assert isinstance(traced(lambda point, _: point[0], 2, 1)(x, scale), float)


@given(XS, XS)
def test_the_time_derivative_is_the_jacobian_along_the_rates(x, x_dot):
    expected = WAVE.height_jacobian(x) @ x_dot
    found = time_derivative(WAVE.height, [x], [x_dot])
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)


@given(XS, between(-3.0, 3.0), XS, between(-3.0, 3.0))
def test_each_argument_moves_at_its_own_rate(x, s, x_dot, s_dot):
    found = time_derivative(lambda x, s: x[0] * s**2 + x[1], [x, s], [x_dot, s_dot])
    assert found == pytest.approx(
        x_dot[0] * s**2 + 2 * x[0] * s * s_dot + x_dot[1], rel=1e-12, abs=1e-12
    )


@given(XS, XS)
def test_matrices_are_differentiated_entry_by_entry(x, x_dot):
    def rows(x: Any) -> Any:
        return ops.matrix([[x[0] ** 2, x[0] * x[1]], [3.0, ops.sin(x[1])]])

    found = time_derivative(rows, [x], [x_dot])
    expected = [
        [2 * x[0] * x_dot[0], x_dot[0] * x[1] + x[0] * x_dot[1]],
        [0.0, np.cos(x[1]) * x_dot[1]],
    ]
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)


@given(XS, XS)
def test_numbers_and_expressions_are_differentiated_alike(x, x_dot):
    lifted, at, rate = lift(WAVE), ca.SX.sym("at", 2), ca.SX.sym("rate", 2)
    symbolic = ca.Function(
        "derivatives",
        [lifted.symbols, at, rate],
        [
            jacobian(lifted.obj.height, at),
            time_derivative(lifted.obj.height, [at], [rate], constants=lifted.obj),
        ],
    )
    slopes, along = (v.full() for v in symbolic(values_of(WAVE), x, x_dot))
    np.testing.assert_allclose(slopes, jacobian(WAVE.height, x), rtol=1e-14)
    numeric = time_derivative(WAVE.height, [x], [x_dot])
    np.testing.assert_allclose(along[:, 0], numeric, rtol=1e-14, atol=1e-14)


def test_a_symbol_without_a_declared_rate_is_refused_by_name():
    """Differentiation would take it for a constant and say nothing."""
    x, forgotten = ca.SX.sym("x"), ca.SX.sym("forgotten")
    with pytest.raises(ExpressionError, match="no rate is declared for forgotten"):
        time_derivative(lambda x: x * forgotten, [x], [1.0])
    with pytest.raises(ExpressionError, match="no rate is declared for forgotten"):
        time_derivative(lambda x: x * forgotten, [2.0], [1.0])
    given_a_rate = time_derivative(lambda x, f: x * f, [2.0, 3.0], [1.0, 10.0])
    assert given_a_rate == 23.0


def test_parameters_are_constant_only_if_they_are_declared():
    lifted, x = lift(WAVE), ca.SX.sym("x", 2)
    with pytest.raises(ExpressionError, match="amplitude"):
        time_derivative(lifted.obj.height, [x], [x])
    assert time_derivative(lifted.obj.height, [x], [x], constants=lifted.obj).shape == (3, 1)


def test_a_function_that_needs_symbols_is_evaluated_at_numbers():
    def slope_at(x: ca.SX) -> ca.SX:
        symbol = ca.SX.sym("symbol")
        return ca.substitute(ca.gradient(symbol**3, symbol), symbol, x)

    assert evaluated(slope_at, 2.0) == 12.0
    symbol = ca.SX.sym("at")
    assert float(ca.Function("f", [symbol], [evaluated(slope_at, symbol)])(2.0)) == 12.0


# Regressors


@st.composite
def integer_matrices(draw: st.DrawFn, rows: int, columns: int) -> np.ndarray:
    entries = st.lists(st.integers(-9, 9), min_size=rows * columns, max_size=rows * columns)
    return np.array(draw(entries), dtype=float).reshape(rows, columns)


def products(pi: Any) -> Any:
    """Monomials as in (43): products of parameters beside the parameters themselves."""
    return ops.vector(pi[0] * pi[2], pi[1] * pi[2], pi[0], pi[1], pi[2])


@given(integer_matrices(2, 5), vectors(3, 10.0))
def test_the_regressor_of_what_is_linear_in_the_monomials_is_exact(Y, pi):
    found = regressor(lambda pi: ca.SX(ca.DM(Y)) @ products(pi), products, 3)
    np.testing.assert_array_equal(found, Y)
    np.testing.assert_allclose(found @ products(pi), Y @ products(pi), rtol=1e-15)


@given(XS, vectors(3, 10.0))
def test_a_regressor_may_depend_on_expressions(x, pi):
    at = ca.SX.sym("at", 2)

    def force(pi: Any, x: Any) -> Any:
        return ops.vector(ops.sin(x[0]) * pi[0] * pi[2] + pi[1], x[1] ** 2 * pi[2] - pi[0])

    Y = ca.Function("Y", [at], [regressor(lambda pi: force(pi, at), products, 3)])(x).full()
    np.testing.assert_allclose(Y @ products(pi), force(pi, x), rtol=1e-12, atol=1e-10)


NONLINEAR = {
    "a square": lambda pi: ops.vector(pi[0] ** 2, pi[1]),
    "a product that is no monomial": lambda pi: ops.vector(pi[0] * pi[1], pi[2]),
    "an offset": lambda pi: ops.vector(pi[0] + 1e-3, pi[1]),
    "a function": lambda pi: ops.vector(ops.sin(pi[0]), pi[1]),
    "a quotient": lambda pi: ops.vector(pi[0] / (1 + pi[1]), pi[2]),
    "a switch": lambda pi: ops.vector(ops.maximum(pi[0] - 0.5, 0.0), pi[1]),
}


@pytest.mark.parametrize("what", list(NONLINEAR))
def test_what_is_not_linear_in_the_monomials_is_refused(what):
    with pytest.raises(ExpressionError, match="not linear in the given monomials"):
        regressor(NONLINEAR[what], products, 3)


@given(between(0.5, 2.0), between(1e-3, 1.0))
def test_a_small_nonlinearity_is_refused_too(slope, curvature):
    assume(curvature > 1e-3 * slope)
    with pytest.raises(ExpressionError):
        regressor(lambda pi: ops.vector(slope * pi[0] + curvature * pi[0] ** 2), lambda pi: pi, 1)


def test_an_expression_that_is_finite_nowhere_is_refused():
    with pytest.raises(ExpressionError, match="not finite at any point"):
        regressor(lambda pi: ops.vector(ops.sqrt(-1 - pi[0] ** 2)), lambda pi: pi, 1)
