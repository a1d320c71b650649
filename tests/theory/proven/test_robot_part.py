"""Proposition A: its bounds over the boxes, and along runs."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import cumulative_simpson

import alight
from alight.control import ForceLimiting, Unsaturated
from alight.symbolic.parameters import rebind
from alight.theory.case import Case, case_of
from alight.theory.lyapunov import V_r
from alight.theory.proven import robot_bounds, robot_bounds_of, tracking_conditions
from alight.theory.proven.robot_part import damping, holding
from tests.control.cases import cases, told
from tests.strategies import between, log_between
from tests.theory.proven.runs import Run, random_run

SEEDS = range(13)


@functools.cache
def shipped(name: str = "experiment-1") -> Case:
    return case_of(alight.load_scenario(name))


# R over the boxes


def V_r_with(case: Case, theta_r: np.ndarray) -> float:
    """``V_r`` at the start if ``theta_r`` were the truth, each entry for itself."""
    arm = rebind(case.plant.arm, p1=theta_r[2], p2=theta_r[5], p3=theta_r[8])
    plant = rebind(case.plant, arm=arm)
    told_truth = np.asarray(case.law.theta_r_of(case.law.pi_of(plant)))
    shift = told_truth - theta_r
    return float(
        V_r(plant, case.law, case.s, case.a._replace(theta_r_hat=case.a.theta_r_hat + shift))
    )


@given(st.lists(between(0.0, 1.0), min_size=10, max_size=10), st.sampled_from([1, 2]))
def test_R_is_at_least_V_r_for_every_truth_in_the_boxes(shares, experiment):
    case = shipped(f"experiment-{experiment}")
    lower, upper = np.array(case.law.theta_r.lower), np.array(case.law.theta_r.upper)
    assert V_r_with(case, lower + shares * (upper - lower)) <= robot_bounds(case).R * (1 + 1e-12)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.6, 1.0])
def test_R_is_V_r_at_one_of_the_corners_of_the_boxes(share):
    """Wherever in the boxes the estimates start: the heaviest arm need not be the farthest."""
    case = shipped()
    lower, upper = np.array(case.law.theta_r.lower), np.array(case.law.theta_r.upper)
    a = case.a._replace(theta_r_hat=lower + share * (upper - lower))
    case = dataclasses.replace(case, a=a)
    farther = np.where(upper - case.a.theta_r_hat > case.a.theta_r_hat - lower, upper, lower)
    found = []
    for corner in np.ndindex(2, 2, 2):
        theta_r = farther.copy()
        theta_r[2:9:3] = np.where(corner, upper[2:9:3], lower[2:9:3])
        found.append(V_r_with(case, theta_r))
    assert max(found) == pytest.approx(robot_bounds(case).R, rel=1e-12)


@pytest.mark.parametrize("name", ["experiment-1", "experiment-2"])
def test_what_is_known_of_the_plant_can_only_narrow_the_bounds(name):
    case = shipped(name)
    known = robot_bounds_of(case.plant, case.law, case.s, case.a)
    assert float(V_r(case.plant, case.law, case.s, case.a)) == known.R
    over = robot_bounds(case)
    for field in ("R", "r_r", "r_r_squared", "e_r", "e_r1_squared", "e_r1_effort"):
        assert np.less_equal(getattr(known, field), getattr(over, field)).all(), field


# What follows from R


@given(cases())
def test_each_part_of_V_r_keeps_its_error_within_the_bounds_at_the_start(case):
    bounds = robot_bounds_of(case.law.model, case.law, case.s, case.a)
    e = case.law.errors(alight.Measurement(*case.s[:4]), case.a.u_f, case.a.theta_dk_hat)
    assert np.less_equal(np.abs(e.r_r), np.multiply(bounds.r_r, 1 + 1e-9)).all()
    assert np.less_equal(np.abs(e.e_r), np.multiply(bounds.e_r, 1 + 1e-9)).all()
    np.testing.assert_allclose(np.abs(e.e_r), bounds.e_r_at(0.0), rtol=1e-9)


@pytest.mark.parametrize("cls", [ForceLimiting, Unsaturated])
def test_the_potential_at_its_bound_is_R(cls):
    law = told(cls=cls)
    s = alight.theory.linearise(law.model, law, "-").state
    column = s + np.array([0.1, -0.2, 1.0, 2.0, *np.zeros(15)])
    state, memory = alight.simulation.continuous.split_state(law, column)
    bounds = robot_bounds_of(law.model, law, state, alight.control.AdaptiveState(**memory))
    assert bounds.R > 1
    for i, reach in enumerate(bounds.e_r_potential):
        assert law.potential(np.eye(2)[i] * reach) == pytest.approx(bounds.R, rel=1e-9)


def squared_integral(run: Run, values: np.ndarray) -> float:
    return float(cumulative_simpson(values**2, x=run.t, initial=0.0)[-1])


@pytest.mark.parametrize("seed", SEEDS)
def test_every_bound_holds_along_a_run(seed):
    run = random_run(seed)
    bounds = robot_bounds_of(run.law.model, run.law, run.s, run.a)
    slack = 1 + 1e-6
    assert (np.abs(run.r_r) <= np.multiply(bounds.r_r, slack)).all()
    assert (np.abs(run.e_r) <= bounds.e_r_at(run.t).T * slack).all()
    assert (bounds.e_r_at(run.t) <= np.multiply(bounds.e_r, slack)[:, None]).all()
    for i in range(2):
        assert squared_integral(run, run.r_r[:, i]) <= bounds.r_r_squared[i] * slack
    e_r1 = run.e_r[:, 0]
    assert squared_integral(run, e_r1) <= bounds.e_r1_squared * slack
    effort = np.array([e * holding(run.law, e) for e in e_r1])
    assert np.trapezoid(effort, run.t) <= bounds.e_r1_effort * slack


def test_each_bound_is_met_within_a_factor_of_two_in_some_run():
    """They do not hold because they are far away; where nothing is unknown they are close."""
    shares = []
    for seed in SEEDS:
        run = random_run(seed)
        bounds = robot_bounds_of(run.law.model, run.law, run.s, run.a)
        shares.append(
            [
                (np.abs(run.r_r) / bounds.r_r).max(),
                (np.abs(run.e_r) / bounds.e_r_at(run.t).T).max(),
                (np.abs(run.e_r) / bounds.e_r).max(),
                squared_integral(run, run.r_r[:, 0]) / bounds.r_r_squared[0],
                squared_integral(run, run.e_r[:, 0]) / bounds.e_r1_squared,
            ]
        )
    assert (np.array(shares).max(axis=0) > 0.5).all()


# The replacement of (39)


@given(log_between(1e-3, 1e3), st.sampled_from([0, 1]))
def test_the_replacement_of_39_asks_for_less_than_the_audit_does(r, axis):
    law = told()
    ratio = law.gains.k3[axis] * r / damping(law, axis, r)
    assert max(1.0, r) * (1 - 1e-12) <= ratio <= r + 1


def test_its_right_side_is_that_of_the_feedback_at_the_largest_error():
    first, second = shipped("experiment-1"), shipped("experiment-2")
    r = robot_bounds(first).r_r
    assert [c.right for c in tracking_conditions(first)] == pytest.approx(r / np.tanh(r))
    assert [c.right for c in tracking_conditions(second)] == pytest.approx([1.0, 1.0])


@pytest.mark.parametrize("name", ["experiment-1", "experiment-2"])
def test_where_it_holds_V_r_and_the_square_of_e_r_fall_together(name):
    """``r f(r) > 2 e r - alpha e^2`` for all errors that are admitted, and not far beyond them."""
    case = shipped(name)
    law, bounds = case.law, robot_bounds(case)
    for i, condition in enumerate(tracking_conditions(case)):
        r = np.linspace(-1, 1, 201) * bounds.r_r[i]
        worst_e = r / law.gains.alpha[i]
        driven = 2 * worst_e * r - law.gains.alpha[i] * worst_e**2
        damped = np.array([v * damping(law, i, v) for v in r])
        assert condition.holds is bool((damped[r != 0] > driven[r != 0]).all())


def test_where_it_fails_V_can_rise_though_V_r_falls():
    """Axis 2 of experiment 1: what (39) is for is not for nothing."""
    case = shipped()
    law, bounds, second = case.law, robot_bounds(case), tracking_conditions(case)[1]
    assert second.holds is False
    r = bounds.r_r[1]
    e = r / law.gains.alpha[1] / 2
    alpha = law.gains.alpha[1]
    assert r * damping(law, 1, r) - 2 * e * r + 2 * alpha * e**2 + alpha * np.tanh(e) * e < 0


@pytest.mark.parametrize("slower", [1.0, 2.0])
def test_a_faster_start_costs_more(slower):
    case = shipped()
    faster = dataclasses.replace(case, s=case.s._replace(q_dot=np.array([slower, -slower])))
    assert robot_bounds(faster).R > robot_bounds(case).R
