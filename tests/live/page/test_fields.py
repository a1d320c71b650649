"""Fields are read off the annotations; a draft is valid as a whole or not at all."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import alight
from alight.control import Gains
from alight.live.bank import Bank
from alight.live.page.draft import Draft, taking_over
from alight.live.page.fields import Bounds, bounds_of, fields_of
from alight.symbolic.parameters import replaced

BANK = Bank.of(alight.load_scenario("experiment-1"))
LOOP = BANK.loops[0]
ITEMS = {item.key: item for item in fields_of(LOOP, "law.gains", "law.target", "law.Gamma_r")}


def draft() -> Draft:
    return Draft(BANK, 0, LOOP)


def test_every_gain_has_fields_with_the_unit_and_meaning_of_its_annotation():
    gains = [item for item in ITEMS.values() if item.path.startswith("law.gains.")]
    assert {item.symbol for item in gains} == {f.name for f in dataclasses.fields(Gains)}
    assert len(gains) == 10
    assert ITEMS["law.gains.k3.1"].quantity.unit == "N"
    assert "(32)" in ITEMS["law.gains.k3.1"].meaning
    assert ITEMS["law.gains.k3.1"].bounds == Bounds(lower=0, above=True)
    assert ITEMS["law.target.x_md"].bounds == Bounds()


@given(value=st.floats(), name=st.sampled_from(["k1", "alpha1", "Gamma"]))
def test_a_field_refuses_what_the_annotation_refuses(value, name):
    told = bounds_of(Gains, name, 1)[0].problem(value)
    try:
        dataclasses.replace(LOOP.law.gains, **{name: value})
        accepted = True
    except alight.AlightError:
        accepted = False
    assert accepted == (told == "")


@given(
    st.dictionaries(
        st.sampled_from(sorted(ITEMS)), st.floats(min_value=1e-3, max_value=1e3), max_size=6
    )
)
def test_a_draft_changes_what_was_typed_and_nothing_else(values):
    values = {key: value for key, value in values.items() if not key.startswith("law.target")}
    made = draft()
    for key, value in values.items():
        made.set(ITEMS[key], repr(value))
    loop = made.loop()
    assert loop is not None
    for key, item in ITEMS.items():
        assert item.of(loop) == values.get(key, item.of(LOOP))
    assert replaced(loop, {p: getattr_path(LOOP, p) for p in made.changed}) == LOOP


def getattr_path(loop, path):
    value = loop
    for name in path.split("."):
        value = getattr(value, name)
    return value


@pytest.mark.parametrize(
    ("key", "text", "problem"),
    [
        ("law.gains.k1", "-1", "must be > 0"),
        ("law.gains.k1", "0", "must be > 0"),
        ("law.gains.k3.1", "", "is not a number"),
        ("law.gains.alpha1", "fast", "is not a number"),
        ("law.gains.alpha1", "inf", "must be > 0"),
        ("law.gains.alpha1", "nan", "must be > 0"),
    ],
)
def test_a_bad_value_is_told_at_its_field_and_spoils_the_draft(key, text, problem):
    made = draft()
    made.set(ITEMS["law.gains.k2"], "0.5")
    made.set(ITEMS[key], text)
    assert made.problems == {key: problem}
    assert made.loop() is None
    made.set(ITEMS[key], "7")
    assert made.loop() is not None


def test_a_target_out_of_reach_spoils_the_draft():
    made = draft()
    made.set(ITEMS["law.target.x_md"], "0.9")
    assert made.loop() is None
    assert "reach" in made.problems[""]


def test_what_was_in_force_before_is_no_change():
    made = draft()
    made.set(ITEMS["law.gains.k1"], "3,5")
    assert made.changed == {"law.gains.k1": 3.5}
    made.set(ITEMS["law.gains.k1"], "2.0")
    assert (made.changed, made.texts) == ({}, {})


@pytest.mark.parametrize("number", range(len(BANK.loops)))
def test_another_law_takes_over_gains_and_target_and_keeps_its_own_model(number):
    before = replaced(LOOP, {"law.gains.alpha1": 20.0, "law.target.x_md": 0.23})
    loop = taking_over(BANK, number, before)
    assert type(loop.law) is type(BANK.loops[number].law)
    assert loop.law.gains == before.law.gains
    assert loop.law.target == before.law.target
    assert loop.law.model == BANK.loops[number].law.model
    assert np.isclose(loop.dt, LOOP.dt)
