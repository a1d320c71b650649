"""`Direct` is the function itself, without its argument handling."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from hypothesis import given

from alight.kernels.direct import Direct
from alight.symbolic.build import build
from alight.symbolic.ops import sin
from tests.strategies import between, vectors

A, X, S = ca.SX.sym("A", 3, 2), ca.SX.sym("x", 2), ca.SX.sym("s")
FUNCTION = build(
    "mixed", {"A": A, "x": X, "s": S}, {"y": A @ X, "B": A * S, "c": sin(S), "zero": ca.SX(2, 2)}
)
DIRECT = Direct(FUNCTION)


@given(vectors(6, 100.0), vectors(2, 100.0), between(-10.0, 10.0))
def test_it_equals_the_function_bit_by_bit(entries, x, s):
    """Matrices go in and come out flattened column by column."""
    found = DIRECT(entries, x, s)
    expected = FUNCTION(entries.reshape(3, 2, order="F"), x, s)
    for array, value in zip(found, expected, strict=True):
        np.testing.assert_array_equal(array, value.full().ravel(order="F"))


def test_each_call_returns_arrays_of_its_own():
    first = DIRECT(np.ones(6), np.ones(2), 1.0)
    kept = [array.copy() for array in first]
    second = DIRECT(np.zeros(6), np.zeros(2), 0.0)
    for array, before in zip(first, kept, strict=True):
        np.testing.assert_array_equal(array, before)
    first[0][:] = 17.0
    assert not second[0].any()


def test_two_of_the_same_function_do_not_share_their_buffers():
    other = Direct(FUNCTION)
    DIRECT(np.ones(6), np.ones(2), 2.0)
    found = other(np.zeros(6), np.ones(2), 0.0)
    assert not any(array.any() for array in found)


@pytest.mark.parametrize(
    "args",
    [
        (),
        (np.ones(6), np.ones(2)),
        (np.ones(5), np.ones(2), 1.0),
        (np.ones((2, 3)), np.ones(2), 1.0),
    ],
    ids=["none", "one short", "a short vector", "a matrix"],
)
def test_arguments_of_another_number_or_shape_are_refused(args):
    with pytest.raises(ValueError, match=r"argument|broadcast"):
        DIRECT(*args)
