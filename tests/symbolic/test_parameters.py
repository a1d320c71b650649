"""Parameter sets: every number stated once, refused where it is wrong, lifted to an input."""

from __future__ import annotations

import dataclasses
from typing import Any

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from alight.errors import AlightError, InvalidParameters
from alight.models import HuntCrossley, LinearSpring, MassSpring, Plant, TwoLinkArm
from alight.symbolic import ops
from alight.symbolic.parameters import (
    is_parameters,
    lift,
    numeric_fields,
    quantities,
    rebind,
    structure_of,
    symbols_of,
    values_of,
)
from alight.testbed import Motors, Testbed
from tests.strategies import between, linear_springs, plants

RIGHT: dict[str, Any] = {"l1": 0.3, "l2": 0.3, "p1": 3.0, "p2": 0.2, "p3": 0.2}


def refusal(make: Any, **values: Any) -> str:
    with pytest.raises(InvalidParameters) as caught:
        make(**values)
    assert isinstance(caught.value, AlightError) and isinstance(caught.value, ValueError)
    assert str(caught.value).startswith(make.__name__)
    assert caught.value.where == make.__name__ and caught.value.problems
    return str(caught.value)


# What is refused


@given(between(-1e6, 0.0))
def test_values_out_of_bounds_are_refused_with_field_value_and_bound(value):
    text = refusal(TwoLinkArm, **{**RIGHT, "l1": value})
    assert f"l1 = {value!r}: Input should be greater than 0" in text


@pytest.mark.parametrize("value", [float("nan"), float("inf"), -float("inf")])
@pytest.mark.parametrize("field", ["l1", "p3"])
def test_numbers_that_are_not_finite_are_refused(field, value):
    assert f"{field} = {value!r}" in refusal(TwoLinkArm, **{**RIGHT, field: value})


@pytest.mark.parametrize(
    ("wrong", "named"),
    [
        ({"viscous": (1.0,)}, "viscous"),
        ({"viscous": (1.0, 2.0, 3.0)}, "viscous = (1.0, 2.0, 3.0)"),
        ({"viscous": 1.0}, "viscous = 1.0"),
        ({"viscous": (1.0, -2.0)}, "viscous.1 = -2.0"),
        ({"viscous": (1.0, float("nan"))}, "viscous.1 = nan"),
        ({"l1": (0.3, 0.3)}, "l1 = (0.3, 0.3)"),
        ({"l1": None}, "l1 = None"),
        ({"l1": "long"}, "l1 = 'long'"),
        ({"plane": "tilted"}, "plane = 'tilted'"),
    ],
)
def test_wrong_shapes_and_kinds_are_refused_with_field_and_value(wrong, named):
    assert named in refusal(TwoLinkArm, **{**RIGHT, **wrong})


def test_unknown_and_missing_names_are_refused():
    assert "l9: unknown name" in refusal(TwoLinkArm, **RIGHT, l9=1.0)
    missing = refusal(TwoLinkArm, l1=0.3)
    for name in ("l2", "p1", "p2", "p3"):
        assert f"{name}: missing" in missing


def test_every_wrong_value_is_named_at_once():
    text = refusal(MassSpring, m=-1.0, k_s=float("nan"), x_0=0.2, stiffness=3.0)
    for part in ("m = -1.0", "k_s = nan", "stiffness: unknown name"):
        assert part in text


def test_nested_sets_are_named_by_their_path():
    arm, body = TwoLinkArm(**RIGHT), MassSpring(m=1.0, k_s=1.0, x_0=0.0)
    text = refusal(Plant, arm=arm, body={"m": -1.0, "k_s": 1.0, "x_0": 0.0}, contact=LinearSpring())
    assert "body.m = -1.0" in text
    text = refusal(Plant, arm=arm, body=body, contact={"type": "glue"})
    assert "contact" in text and "glue" in text and "'linear-spring'" in text


def test_a_set_cannot_be_changed():
    arm = TwoLinkArm(**RIGHT)
    with pytest.raises(dataclasses.FrozenInstanceError):
        arm.l1 = 1.0
    assert rebind(arm, l1=1.0).l1 == 1.0 and arm.l1 == 0.3


# Lifting


def field_at(obj: Any, path: str) -> Any:
    """Value at a path; an index from 1 at its end chooses an entry of a vector."""
    *sets, name = path.split(".")
    for part in sets:
        obj = getattr(obj, part)
    if hasattr(obj, name):
        return getattr(obj, name)
    return getattr(obj, name[:-1])[int(name[-1]) - 1]


@given(plants())
def test_paths_symbols_and_values_stand_in_one_order(plant):
    lifted, values = lift(plant), values_of(plant)
    assert len(lifted.paths) == len(values) == lifted.symbols.numel()
    assert len(set(lifted.paths)) == len(lifted.paths)
    for i, path in enumerate(lifted.paths):
        assert values[i] == field_at(plant, path)
        assert ca.is_equal(lifted.symbols[i], ca.SX(field_at(lifted.obj, path)))


@given(plants())
def test_values_put_back_in_place_of_the_symbols_give_the_set_again(plant):
    lifted = lift(plant)
    for path, value, _ in numeric_fields(plant):
        expression = field_at(lifted.obj, path)
        placed = ca.evalf(ca.substitute(expression, lifted.symbols, ca.SX(values_of(plant))))
        np.testing.assert_array_equal(np.ravel(placed.full()), np.ravel(value))


@given(plants())
def test_every_symbol_of_a_lifted_set_is_found_in_it(plant):
    lifted = lift(plant)
    found = {s.element_hash() for s in symbols_of(lifted.obj)}
    assert found == {s.element_hash() for s in ca.vertsplit(lifted.symbols)}
    assert symbols_of(plant) == []


def test_prefixes_nested_sets_and_vectors_show_in_the_paths():
    paths = lift(Testbed(motors=Motors(artificial_limit=(44.0, 15.0))), "testbed.").paths
    for path in (
        "testbed.sample_rate",
        "testbed.encoder.counts",
        "testbed.motors.limit2",
        "testbed.motors.artificial_limit1",
    ):
        assert path in paths


@given(plants(), st.data())
def test_what_is_left_out_keeps_its_numbers_and_the_rest_its_order(plant, data):
    fields = [path for path, _, _ in numeric_fields(plant)]
    left_out = data.draw(st.sets(st.sampled_from(fields)))
    lifted = lift(plant, but=left_out)
    assert len(lifted.paths) == lifted.symbols.numel() == len(values_of(plant, but=left_out))
    for path in fields:
        if path in left_out:
            assert field_at(lifted.obj, path) == field_at(plant, path)
        else:
            assert ca.symvar(ca.SX(ops.as_vector(field_at(lifted.obj, path))))
    kept = [np.atleast_1d(v) for path, v, _ in numeric_fields(plant) if path not in left_out]
    expected = np.concatenate([np.zeros(0), *kept])
    np.testing.assert_array_equal(values_of(plant, but=left_out), expected)


def test_what_shapes_the_graph_is_not_lifted():
    """Words, switches and counts choose the expression; only numbers become inputs."""
    contact = HuntCrossley(exponent=1.5)
    lifted = lift(contact)
    assert lifted.paths == ("K_I", "exponent", "dissipation")
    assert lifted.obj.type == "hunt-crossley"
    assert "delay" not in lift(Testbed(delay=True)).paths


@given(plants())
def test_each_lifted_number_of_a_plant_has_a_meaning(plant):
    for path, _, quantity in numeric_fields(plant):
        assert quantity.meaning, path
    assert quantities(TwoLinkArm)["p1"].unit == "kg m^2"


def test_a_parameter_set_is_an_instance_and_not_a_class_or_a_number():
    assert is_parameters(LinearSpring())
    assert not is_parameters(LinearSpring) and not is_parameters(1.0)


# What shapes a graph


@given(plants(linear_springs()), plants(linear_springs()))
def test_sets_that_differ_in_numbers_only_share_a_structure_and_its_paths(plant, other):
    assert structure_of(plant) == structure_of(other)
    assert hash(structure_of(plant)) == hash(structure_of(other))
    assert lift(plant).paths == lift(other).paths


def test_whatever_shapes_the_graph_shapes_the_structure():
    arm, body = TwoLinkArm(**RIGHT), MassSpring(m=1.0, k_s=1.0, x_0=0.0)
    different = [
        Plant(arm, body, LinearSpring()),
        Plant(arm, body, HuntCrossley()),
        Plant(rebind(arm, plane="vertical"), body, LinearSpring()),
        Testbed(),
        Testbed(delay=True),
        Testbed(motors=Motors(artificial_limit=(44.0, 15.0))),
    ]
    assert len({structure_of(obj) for obj in different}) == len(different)


def test_a_count_and_a_number_in_its_place_are_two_structures():
    """The count stands in the graph, the number is an input of it."""

    @dataclasses.dataclass
    class Set:
        gain: float

    for count, number in ((1, 1.0), (2, (1.0, 1.0)), (True, 1.0)):
        shapes = [len(lift(Set(gain)).paths) for gain in (count, number)]
        assert shapes[0] != shapes[1]
        assert structure_of(Set(count)) != structure_of(Set(number))


def test_arrays_that_differ_in_any_entry_are_two_structures():
    """They are no inputs: their entries stand in the graph."""

    @dataclasses.dataclass
    class Set:
        gains: np.ndarray

    entries = np.zeros(2000)
    last = entries + (np.arange(2000) == 1500)
    for one, other in ((entries[:1], entries[:1] + 1e-12), (entries, last)):
        assert structure_of(Set(one)) != structure_of(Set(other))
