"""Bounds of the task-space inertia over a box of inertias and every pose."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import brentq

import alight
from alight.control import ForceLimiting
from alight.errors import AlightError
from alight.models import TwoLinkArm
from alight.theory.inertia import inertia_bounds, inertia_box
from tests.control.cases import PLANT, told
from tests.strategies import arms, between

SLACK = 1 + 1e-9


def numbers(arm: TwoLinkArm) -> np.ndarray:
    return np.array([arm.p1, arm.p2, arm.p3])


def least_singular_value(arm: TwoLinkArm, q2: float) -> float:
    return float(np.linalg.svd(arm.J(np.array([0.0, q2])), compute_uv=False)[-1])


@given(arms(), between(0.02, 0.6), between(0.0, 0.02), st.integers(0, 2**32 - 1))
def test_no_admitted_inertia_and_pose_leaves_the_bounds(arm, share, width, seed):
    sigma_J = share * max(least_singular_value(arm, q2) for q2 in np.linspace(0, np.pi, 50))
    p = numbers(arm)
    lower, upper = p - width * np.abs(p), p + width * np.abs(p)
    try:
        bounds = inertia_bounds(arm, lower, upper, sigma_J)
    except AlightError as error:  # an arm that is close to a point mass at its tip
        assert "not positive definite" in str(error)
        return
    rng = np.random.default_rng(seed)
    for q in rng.uniform(-np.pi, np.pi, (30, 2)):
        if least_singular_value(arm, q[1]) < 1e-3:
            continue
        spectrum = np.linalg.eigvalsh(arm.with_inertia(rng.uniform(lower, upper)).M_bar(q))
        assert spectrum[0] >= bounds.a1 / SLACK
        assert np.diag(np.linalg.inv(arm.M_bar(q))).max() <= bounds.mobility * SLACK
        if least_singular_value(arm, q[1]) >= sigma_J:
            assert spectrum[1] <= bounds.a2 * SLACK


def test_the_bounds_are_reached():
    arm, p = PLANT.arm, numbers(PLANT.arm)
    bounds = inertia_bounds(arm, p, p, 0.1)

    def spectrum(q2: float) -> np.ndarray:
        return np.linalg.eigvalsh(arm.M_bar(np.array([0.3, q2])))

    elbows = np.linspace(0.0, np.pi, 1001)[1:-1]
    assert bounds.a1 == pytest.approx(min(spectrum(q2)[0] for q2 in elbows), rel=1e-5)
    borders = [
        brentq(lambda q2: least_singular_value(arm, q2) - 0.1, *pair)
        for pair in ((1e-3, 1.5), (1.5, np.pi - 1e-3))
    ]
    assert bounds.a2 == pytest.approx(max(spectrum(q2)[1] for q2 in borders), rel=1e-6)


def test_the_box_of_the_arm_is_that_of_the_third_of_each_block():
    law = alight.load_scenario("experiment-1").law
    assert isinstance(law, ForceLimiting)
    lower, upper = inertia_box(law)
    p = law.pi_of(law.model)[:3]
    assert (lower <= p).all() and (p <= upper).all()
    np.testing.assert_array_equal(law.theta_r_of(law.pi_of(law.model))[2:9:3], p)


def test_a_box_that_admits_no_inertia_matrix_is_refused_with_the_corner():
    p = numbers(PLANT.arm)
    with pytest.raises(AlightError, match=r"p1 = .*p2 = .*p3 = .*not positive definite"):
        inertia_bounds(PLANT.arm, np.array([p[1] / 2, p[1], p[2]]), p, 0.1)


def test_a_box_that_admits_no_inertia_matrix_needs_a_bound_from_elsewhere():
    p = numbers(PLANT.arm)
    low = np.array([p[1] / 2, p[1], p[2]])
    bounds = inertia_bounds(PLANT.arm, low, p, 0.1, a1=0.3)
    known = inertia_bounds(PLANT.arm, p, p, 0.1)
    assert bounds.a1 == 0.3 and bounds.a2 >= known.a2 / SLACK
    assert inertia_bounds(PLANT.arm, p, p, 0.1, a1=known.a1 / 2) == known


def test_a_demand_that_no_pose_meets_is_refused_with_the_best_pose():
    p = numbers(told().model.arm)
    with pytest.raises(AlightError, match=r"assumptions.sigma_J = 5: no pose .* is 0\.\d+ m"):
        inertia_bounds(PLANT.arm, p, p, 5.0)
