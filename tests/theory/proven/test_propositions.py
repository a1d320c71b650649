"""What a certificate shows of the propositions."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
import pytest

import alight
from alight.theory import loc_margin
from alight.theory.case import Case, case_of
from alight.theory.proven import (
    constants,
    first_contact,
    loc_adapting_margin,
    nearest_vtx_of,
    propositions,
    robot_bounds,
    vtx_margin,
)

EXPERIMENTS = ["experiment-1", "experiment-2"]
NUMBERS = ["LOC", "LOC, adapting", "VTX", "A, axis 1", "A, axis 2", "filter"]


@functools.cache
def shipped(name: str) -> Case:
    return case_of(alight.load_scenario(name))


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_every_condition_has_both_sides_a_unit_and_a_meaning(name):
    found = propositions(shipped(name))
    assert [condition.number for condition in found] == NUMBERS
    for condition in found:
        assert np.isfinite([condition.left, condition.right]).all()
        assert condition.unit and condition.meaning.endswith(".")
        assert condition.holds is not None


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_their_margins_are_those_of_the_functions(name):
    case = shipped(name)
    margin = {condition.number: condition.margin for condition in propositions(case)}
    g, b = case.law.gains, case.bounds
    assert margin["LOC"] == pytest.approx(loc_margin(g))
    worst = b.zeta_K[0] / b.m_u
    assert margin["LOC, adapting"] == pytest.approx(loc_adapting_margin(g, worst, 0.03))
    assert margin["VTX"] == pytest.approx(vtx_margin(g, b.m_u, b.zeta_K[0]))


def test_what_the_audit_found_of_both_experiments():
    """LOC fails for (42) and holds for the gains of experiment 2; VTX holds for neither."""
    first, second = (
        {condition.number: condition.holds for condition in propositions(shipped(name))}
        for name in EXPERIMENTS
    )
    assert not first["LOC"] and not first["LOC, adapting"] and not first["VTX"]
    assert second["LOC"] and second["LOC, adapting"] and not second["VTX"]
    assert first["A, axis 1"] and not first["A, axis 2"]
    assert second["A, axis 1"] and second["A, axis 2"]
    assert first["filter"] and second["filter"]


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_constants_have_a_number_or_say_why_not(name):
    case = shipped(name)
    found = {constant.symbol: constant for constant in constants(case)}
    for constant in found.values():
        assert (constant.value is None) == bool(constant.undefined)
        assert constant.value is None or np.isfinite(constant.value)
        assert constant.meaning.endswith(".")
    robot, touch = robot_bounds(case), first_contact(case)
    assert found["R"].value == robot.R
    assert found["sup |e_r1|"].value == robot.e_r[0]
    assert found["t_contact"].value == touch.latest
    assert "VTX" in found["sup F_m"].undefined


def test_with_certified_gains_the_bounds_of_contact_have_numbers():
    case = shipped("experiment-1")
    near = dataclasses.replace(nearest_vtx_of(case), alpha1=5.0, alpha3=1.0)
    case = dataclasses.replace(case, law=dataclasses.replace(case.law, gains=near))
    found = {constant.symbol: constant for constant in constants(case)}
    for symbol in ("V_m", "sup |e_m|", "sup |e_f|", "sup |eta_m|"):
        assert found[symbol].value > 0, symbol
    assert found["sup F_m"].undefined == "beyond every number"
