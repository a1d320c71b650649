"""Layouts: named signals in one column, and back."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from alight.errors import ExpressionError
from alight.symbolic.signals import Layout, Signal
from tests.strategies import vectors

NAMES = st.text("abcdefgh_", min_size=1, max_size=6)
LAYOUTS = st.dictionaries(NAMES, st.integers(1, 5), min_size=1, max_size=6).map(
    lambda sizes: Layout({name: Signal("m", "anything", size) for name, size in sizes.items()})
)


@given(st.data(), LAYOUTS)
def test_unpacking_after_packing_is_the_identity(data, layout):
    column = data.draw(vectors(layout.size, 10.0))
    values = layout.unpack(column)
    assert list(values) == list(layout.signals)
    np.testing.assert_array_equal(layout.pack(values), column)


@given(st.data(), LAYOUTS)
def test_the_layout_sets_the_order_and_not_the_values_given(data, layout):
    column = data.draw(vectors(layout.size, 10.0))
    values = layout.unpack(column)
    shuffled = dict(data.draw(st.permutations(list(values.items()))))
    np.testing.assert_array_equal(layout.pack(shuffled), column)


@given(LAYOUTS)
def test_expressions_are_packed_like_numbers(layout):
    column = ca.SX.sym("column", layout.size)
    assert ca.is_equal(layout.pack(layout.unpack(column)), column)
    for name, rows in layout.slices().items():
        assert ca.is_equal(layout.unpack(column)[name], column[rows])


@given(st.data(), LAYOUTS)
def test_signals_of_size_one_unpack_to_scalars_and_others_to_vectors(data, layout):
    values = layout.unpack(data.draw(vectors(layout.size, 10.0)))
    for name, signal in layout.signals.items():
        assert np.shape(values[name]) == (() if signal.size == 1 else (signal.size,))


@given(LAYOUTS)
def test_slices_cover_the_column_once_and_every_scalar_has_name_and_unit(layout):
    covered = np.concatenate([np.arange(layout.size)[rows] for rows in layout.slices().values()])
    np.testing.assert_array_equal(covered, np.arange(layout.size))
    assert len(layout.columns) == len(layout.units) == layout.size


def test_a_layout_without_signals_is_an_empty_column():
    layout = Layout({})
    assert layout.size == 0 and layout.columns == ()
    assert layout.pack({}).shape == (0,) and layout.unpack(layout.pack({})) == {}


def test_entries_of_vectors_are_counted_from_one():
    layout = Layout({"e_m": Signal("m", "mass"), "e_r": Signal("mm", "tip", 2)})
    assert layout.columns == ("e_m", "e_r1", "e_r2")
    assert layout.units == ("m", "mm", "mm")


def test_a_layout_is_read_off_an_annotated_structure():
    class State(NamedTuple):
        q: Annotated[Any, Signal("rad", "angles", 2)]
        note: str
        x: Annotated[Any, Signal("m", "position")]

    layout = Layout.of(State)
    assert layout.columns == ("q1", "q2", "x") and layout.units == ("rad", "rad", "m")


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        ({"a": 1.0}, r"\['a'\] given where \['a', 'b'\]"),
        ({"a": 1.0, "b": [1.0, 2.0], "c": 3.0}, r"\['a', 'b', 'c'\] given"),
        ({"a": 1.0, "b": [1.0, 2.0, 3.0]}, "'b' has 3 entries, not 2"),
        ({"a": ca.SX.sym("a", 2), "b": [1.0, 2.0]}, "'a' has 2 entries, not 1"),
    ],
)
def test_values_that_do_not_fit_the_layout_are_refused(values, reason):
    layout = Layout({"a": Signal("m", "one"), "b": Signal("m", "two", 2)})
    with pytest.raises(ExpressionError, match=reason):
        layout.pack(values)
