"""The domain of the filter, and Proposition D."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from numpy import tanh

import alight
from alight.control.error_system import eta_m, u_f_dot
from alight.theory.case import case_of
from alight.theory.proven import contact_from_V, filter_condition, filter_room, swing_floor
from tests.control.cases import EXPERIMENT_1, gains
from tests.strategies import between


@given(gains(), between(-2.0, 2.0), between(-50.0, 50.0))
def test_at_both_ends_of_the_domain_the_filter_moves_inwards_just_where_there_is_room(g, e_m, v):
    inwards = [-side * u_f_dot(g, e_m, eta_m(g, e_m, v, side), side) for side in (-1.0, 1.0)]
    assert (min(inwards) > 0) == (filter_room(g, e_m, v) > 0)


def test_without_room_the_filter_escapes_in_finite_time():
    g = dataclasses.replace(EXPERIMENT_1, alpha1=600.0)  # 600 tanh(0.03) = 18 > 15
    assert filter_room(g, 0.03, 0.0) < 0 < filter_room(EXPERIMENT_1, 0.03, 0.0)

    def lowest(gains_, steps=20_000, dt=1e-5):
        u = 0.0
        for _ in range(steps):
            u += dt * u_f_dot(gains_, 0.03, eta_m(gains_, 0.03, 0.0, u), u)
            if abs(u) >= 1:
                break
        return u

    assert lowest(g) <= -1 < -0.2 < lowest(EXPERIMENT_1)


@given(gains(), between(0.0, 0.3), between(-1.0, 1.0))
def test_the_room_at_rest_is_a_speed_limit(g, e_m, share):
    limit = filter_room(g, e_m, 0.0)
    if limit > 0:
        assert filter_room(g, e_m, 0.999 * share * limit) > 0
    assert filter_room(g, e_m, -1.001 * abs(limit)) < 0


def test_the_condition_of_experiment_1():
    condition = filter_condition(case_of(alight.load_scenario("experiment-1")))
    assert condition.holds
    assert (condition.left, condition.right) == (15.0, pytest.approx(55 * tanh(0.03)))


# Proposition D


def average(d: float, amplitude: float) -> float:
    """Time average of ``tanh^2`` over a swing about ``d``."""
    phase = np.linspace(0.0, 2 * np.pi, 4001)[:-1]
    return float(np.mean(tanh(d + amplitude * np.sin(phase)) ** 2))


@given(between(-3.0, 3.0), between(0.0, 30.0))
def test_no_swing_has_a_smaller_average_of_tanh2_than_the_floor(d, amplitude):
    assert average(d, amplitude) >= swing_floor(d) * (1 - 1e-9)


@given(between(0.01, 3.0))
def test_the_floor_is_met_by_a_pair_of_instants(d):
    """No larger floor follows from pairs ``d + delta``, ``d - delta``; up to 0.658 it is met."""
    delta = np.linspace(0.0, 20.0, 200_001)
    least = ((tanh(d + delta) ** 2 + tanh(d - delta) ** 2) / 2).min()
    assert least == pytest.approx(swing_floor(d), rel=1e-6)


def test_beyond_the_domain_of_Jensen_tanh2_of_the_middle_is_no_floor():
    """Of the middle, not of the amplitude: ``tanh^2(d)`` holds for every swing about 0.65."""
    swings = np.linspace(0.0, 5.0, 201)
    assert min(average(0.65, a) for a in swings) >= tanh(0.65) ** 2 * (1 - 1e-12)
    assert min(average(1.0, a) for a in swings) < tanh(1.0) ** 2


def test_the_condition_has_both_sides_or_says_why_not():
    held = contact_from_V(1e-6, 0.1, 0.03)
    assert held.holds and held.right == pytest.approx(0.1 * tanh(0.03) ** 2)
    assert contact_from_V(1e-3, 0.1, 0.03).holds is False
    open_ = contact_from_V(1e-6, None, 0.03, "lambda has no value")
    assert open_.holds is None and open_.undefined
