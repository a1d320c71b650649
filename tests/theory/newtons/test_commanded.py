"""What the law can command: bounds of the feedback, and the interval over the projection box."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from alight.control import AdaptiveState, ForceLimiting, Measurement, Unsaturated
from alight.models import TwoLinkArm
from alight.symbolic.build import build
from alight.theory.lyapunov import errors_at, ideal_measurement
from alight.theory.newtons import feedback_limit, feedback_within, force_interval, joint_limit
from alight.theory.newtons.feedback import joint_limit_of_all_poses
from tests.control.cases import Case, cases, told
from tests.strategies import arms, between, vectors


def commanded(case: Case, theta_r_hat: np.ndarray) -> np.ndarray:
    state = case.a._replace(theta_r_hat=theta_r_hat)._asdict()
    return np.asarray(case.law.flow(state, ideal_measurement(case.s)).signals["F"])


@pytest.mark.parametrize("cls", [ForceLimiting, Unsaturated])
@settings(max_examples=12)
@given(data=st.data())
def test_the_interval_holds_every_admitted_estimate_and_is_reached(cls, data):
    case = data.draw(cases(cls))
    lower, upper = force_interval(case.law, ideal_measurement(case.s), case.a)
    slack = 1e-9 * (np.abs(lower) + np.abs(upper))
    F = commanded(case, case.a.theta_r_hat)
    assert (lower - slack <= F).all() and (upper + slack >= F).all()
    low, high = (np.asarray(v) for v in case.law.theta_r.widened)
    e = errors_at(case.law, case.s, case.a)
    Y_r = np.asarray(case.law.Y_r(ideal_measurement(case.s), e))
    for i in range(2):
        assert commanded(case, np.where(Y_r[i] > 0, high, low))[i] == pytest.approx(
            upper[i], abs=slack[i]
        )
        assert commanded(case, np.where(Y_r[i] > 0, low, high))[i] == pytest.approx(
            lower[i], abs=slack[i]
        )


def test_the_interval_is_built_once_on_symbols():
    law = told()
    q, q_dot = ca.SX.sym("q", 2), ca.SX.sym("q_dot", 2)
    x_m, x_m_dot, u_f = ca.SX.sym("x_m"), ca.SX.sym("x_m_dot"), ca.SX.sym("u_f")
    state = AdaptiveState(u_f, law.theta_dk.initial, law.theta_r.initial)
    lower, upper = force_interval(law, Measurement(q, q_dot, x_m, x_m_dot), state)
    inputs = {"q": q, "q_dot": q_dot, "x_m": x_m, "x_m_dot": x_m_dot, "u_f": u_f}
    monitor = build("monitor", inputs, {"lower": lower, "upper": upper})
    numbers = np.array([0.9, -1.1]), np.array([0.1, 0.2]), 0.21, 0.01, 0.1
    found = monitor(*numbers)
    at = AdaptiveState(0.1, law.theta_dk.initial, np.array(law.theta_r.initial))
    for mine, direct in zip(found, force_interval(law, Measurement(*numbers[:4]), at), strict=True):
        np.testing.assert_allclose(np.asarray(mine).ravel(), direct, rtol=1e-12)


@given(e_r=vectors(2, 1e3), r_r=vectors(2, 1e3))
def test_the_feedback_of_32_never_passes_its_limit_and_reaches_it(e_r, r_r):
    law = told()
    limit = feedback_limit(law)
    np.testing.assert_allclose(limit, 1 + np.array(law.gains.k3), rtol=1e-15)
    assert (np.abs(law.feedback(e_r, r_r)) <= limit).all()


def test_the_feedback_of_44_has_no_limit():
    assert feedback_limit(told(cls=Unsaturated)) is None


@pytest.mark.parametrize("cls", [ForceLimiting, Unsaturated])
@given(e_r=vectors(2, 3.0), r_r=vectors(2, 30.0), share=vectors(4, 1.0))
def test_no_errors_within_bounds_pass_the_feedback_at_the_bounds(cls, e_r, r_r, share):
    law = told(cls=cls)
    most = feedback_within(law, np.abs(e_r), np.abs(r_r))
    inside = law.feedback(share[:2] * e_r, share[2:] * r_r)
    assert (np.abs(inside) <= most * (1 + 1e-12)).all()
    np.testing.assert_allclose(law.feedback(np.abs(e_r), np.abs(r_r)), most, rtol=1e-12)


@given(arms(), vectors(2, 100.0), st.integers(0, 2**32 - 1))
def test_no_pose_passes_the_torque_of_all_poses_and_one_reaches_it(arm: TwoLinkArm, force, seed):
    force = np.abs(force)
    most = joint_limit_of_all_poses(arm, force)
    rng = np.random.default_rng(seed)
    for q in rng.uniform(-np.pi, np.pi, (10, 2)):
        J = np.asarray(arm.J(q))
        torque = joint_limit(J, force)
        assert (np.abs(J.T @ (rng.choice([-1.0, 1.0], 2) * force)) <= torque * (1 + 1e-12)).all()
        assert (torque <= most * (1 + 1e-12)).all()
    # stretched, the base turned by q1: every column of J along q1 + 90 degrees
    lengths = np.linalg.norm(np.asarray(arm.J(np.zeros(2))), axis=0)
    q1 = np.linspace(-np.pi, np.pi, 721)
    along = np.abs(np.sin(q1)) * force[0] + np.abs(np.cos(q1)) * force[1]
    np.testing.assert_allclose(along.max() * lengths, most, rtol=1e-4)


@given(between(-1.0, 1.0), between(-1.0, 1.0))
def test_many_poses_at_once_give_what_each_gives(q1, q2):
    arm, force = told().model.arm, np.array([96.0, 6.0])
    poses = np.array([arm.J(np.array([q1, 1.0])), arm.J(np.array([0.0, q2]))])
    each = [joint_limit(pose, force) for pose in poses]
    np.testing.assert_array_equal(joint_limit(poses, force), each)
