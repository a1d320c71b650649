"""Property 4, (13)-(15): the inequalities of the hyperbolic functions that the proofs rest on."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from alight.symbolic import ops
from tests.strategies import between

EPS = np.finfo(float).eps

ENTRIES = st.one_of(between(-1e-3, 1e-3), between(-3.0, 3.0), between(-1e5, 1e5))
VECTORS = st.lists(ENTRIES, min_size=1, max_size=6).map(np.array)


def norm(xi: np.ndarray) -> float:
    return float(np.sqrt(xi @ xi))


@given(VECTORS)
def test_13_the_norm_exceeds_that_of_its_tanh(xi):
    assert norm(xi) * (1 + 4 * EPS) >= norm(ops.tanh(xi))


@given(VECTORS)
def test_13_one_plus_the_norm_exceeds_the_norm_over_its_tanh(xi):
    size = norm(xi)
    ratio = size / ops.tanh(size) if size > 0 else 1.0
    assert (size + 1) * (1 + 4 * EPS) >= ratio


@given(VECTORS)
def test_14_the_square_of_the_norm_exceeds_the_sum_of_log_cosh(xi):
    rounding = 4 * EPS * (1 + np.abs(xi).sum())
    assert norm(xi) ** 2 + rounding >= ops.total(ops.log_cosh(xi))


@given(VECTORS)
def test_14_the_sum_of_log_cosh_exceeds_log_cosh_of_the_norm(xi):
    rounding = 4 * EPS * (1 + np.abs(xi).sum())
    assert ops.total(ops.log_cosh(xi)) + rounding >= ops.log_cosh(norm(xi))


@given(VECTORS)
def test_14_holds_with_half_the_square(xi):
    rounding = 4 * EPS * (1 + np.abs(xi).sum())
    assert norm(xi) ** 2 / 2 + rounding >= ops.total(ops.log_cosh(xi))


@given(VECTORS)
def test_15_the_three_squares_of_tanh_are_ordered(xi):
    saturated = ops.tanh(xi)
    product, square, least = ops.dot(xi, saturated), norm(saturated) ** 2, ops.tanh(norm(xi)) ** 2
    assert product * (1 + 8 * EPS) >= square
    assert square * (1 + 8 * EPS) >= least


@pytest.mark.parametrize("size", [0.0, 1e5])
def test_the_inequalities_are_finite_at_the_ends(size):
    xi = np.full(3, size)
    assert np.isfinite([ops.total(ops.log_cosh(xi)), ops.log_cosh(norm(xi)), *ops.tanh(xi)]).all()
