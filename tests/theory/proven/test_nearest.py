"""The gains nearest to given ones that satisfy VTX."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
import pytest
from hypothesis import given, settings

import alight
from alight.control import Gains
from alight.symbolic.parameters import rebind
from alight.theory import loc_margin
from alight.theory.case import case_of
from alight.theory.proven import filter_room, nearest_vtx, nearest_vtx_of, vtx_margin
from tests.control.cases import EXPERIMENT_1, EXPERIMENT_2, gains
from tests.strategies import log_between
from tests.theory.proven.designs import FREE

GIVEN = {"experiment-1": EXPERIMENT_1, "experiment-2": EXPERIMENT_2}
M, K_I, E_M = 2.7, 5.5e4, 0.03
"""Worst mass and contact stiffness that the shipped scenarios assume, and their way to go."""


@functools.cache
def near(name: str) -> Gains:
    return nearest_vtx_of(case_of(alight.load_scenario(name)))


def logarithms(g: Gains) -> np.ndarray:
    return np.log([getattr(g, name) for name in FREE])


def distance(g: Gains, other: Gains) -> float:
    return float(np.linalg.norm(logarithms(g) - logarithms(other)))


def holding(x: np.ndarray) -> np.ndarray:
    """Which of many logarithms, shape (5, n), satisfy both conditions."""
    g = rebind(EXPERIMENT_1, **dict(zip(FREE, np.exp(x), strict=True)))
    return (vtx_margin(g, M, K_I) > 0) & (filter_room(g, E_M, 0.0) > 0)


@pytest.mark.parametrize("name", sorted(GIVEN))
def test_it_satisfies_VTX_LOC_and_the_filters_domain_at_the_worst_of_the_assumptions(name):
    case, found = case_of(alight.load_scenario(name)), near(name)
    assert case.law.gains == GIVEN[name]
    assert (case.bounds.m_u, case.bounds.zeta_K[0]) == (M, K_I)
    assert vtx_margin(GIVEN[name], M, K_I) < 0 < vtx_margin(found, M, K_I)
    assert filter_room(found, E_M, 0.0) > 0
    assert loc_margin(found) > 0
    assert found == nearest_vtx(GIVEN[name], M, K_I, E_M)


@pytest.mark.parametrize("name", sorted(GIVEN))
def test_it_changes_nothing_but_the_five_gains_and_states_three_digits(name):
    found, same = near(name), GIVEN[name]
    kept = {"k3", "alpha", "Gamma"}
    assert {f for f in kept if getattr(found, f) == getattr(same, f)} == kept
    for gain in FREE:
        value = getattr(found, gain)
        assert value == float(f"{value:.2e}"), gain


@pytest.mark.parametrize("name", sorted(GIVEN))
def test_no_nearer_gains_are_found_by_a_search_around_the_given_ones(name):
    """Over directions as well as over the neighbourhood of the answer: but for the rounding."""
    rng, centre = np.random.default_rng(7), logarithms(GIVEN[name])
    radius = distance(near(name), GIVEN[name])
    directions = rng.normal(size=(5, 300_000))
    directions /= np.linalg.norm(directions, axis=0)
    scattered = directions * radius * 0.99 * rng.uniform(0.2, 1.0, 300_000) ** 0.2
    answer = logarithms(near(name)) - centre
    close = answer[:, None] + rng.normal(size=(5, 300_000)) * 0.05 * radius
    close *= np.minimum(1.0, 0.995 * radius / np.linalg.norm(close, axis=0))
    for offsets in (scattered, close):
        assert not holding(centre[:, None] + offsets).any()
    farther = answer[:, None] + rng.normal(size=(5, 300_000)) * 0.05 * radius
    assert holding(centre[:, None] + farther).any()


@pytest.mark.parametrize("name", sorted(GIVEN))
def test_it_lies_on_the_border(name):
    """A step of one percent towards the given gains violates the conditions."""
    found, given_ = logarithms(near(name)), logarithms(GIVEN[name])
    back = found + 0.01 * (given_ - found)
    assert not holding(back[:, None]).any()


def test_gains_that_satisfy_both_are_returned_as_they_are():
    good = near("experiment-1")
    assert nearest_vtx(good, M, K_I, E_M) is good


def test_the_filters_domain_alone_can_move_them():
    good = dataclasses.replace(near("experiment-1"), k1=500.0, alpha1=20.0, alpha2=10.0, k2=50.0)
    assert vtx_margin(good, M, 1e9) > 0 > filter_room(good, 0.6, 0.0)
    found = nearest_vtx(good, M, 1e9, 0.6)
    assert filter_room(found, 0.6, 0.0) > 0
    assert distance(found, good) < 0.1


def test_the_gains_that_satisfy_both_are_convex_in_their_logarithms():
    """Hence there is one nearest set: between two sets that hold both, all hold both."""
    rng = np.random.default_rng(8)
    tried = logarithms(EXPERIMENT_1)[:, None] + rng.normal(0.0, 4.0, (5, 200_000))
    inside = tried[:, holding(tried)]
    one, other = inside[:, ::2], inside[:, 1::2]
    count = min(one.shape[1], other.shape[1])
    share = rng.uniform(0.0, 1.0, count)
    between_them = share * one[:, :count] + (1 - share) * other[:, :count]
    assert count > 10_000 and holding(between_them).all()
    outside = tried[:, ~holding(tried)]
    half = (outside[:, ::2][:, :count] + outside[:, 1::2][:, :count]) / 2
    assert holding(half).any()  # of those that fail this cannot be said


@settings(max_examples=25)
@given(gains(), log_between(0.3, 20.0), log_between(5e3, 5e5))
def test_it_is_found_for_all_kinds_of_gains(g, m, K):
    found = nearest_vtx(g, m, K, E_M)
    assert vtx_margin(found, m, K) > 0
    assert filter_room(found, E_M, 0.0) > 0
