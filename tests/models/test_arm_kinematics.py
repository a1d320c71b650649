"""Kinematics (2): position, its inverse with both elbows, the Jacobian and its rate."""

from __future__ import annotations

import functools
import re
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from alight.errors import AlightError, UnknownName, Unreachable
from alight.models import TwoLinkArm
from alight.symbolic.derive import time_derivative
from tests.lifted import Evaluate, lifted
from tests.strategies import arms, between, poses, rates

ELBOWS = st.sampled_from(["+", "-"])
UNIT_ARM = TwoLinkArm(l1=1.0, l2=1.0, p1=3.0, p2=1.0, p3=0.5)


@functools.cache
def kinematics() -> Evaluate:
    def expressions(arm: Any, q: Any, q_dot: Any) -> dict[str, Any]:
        return {
            "x_r": arm.x_r(q),
            "x_r_dot": time_derivative(arm.x_r, [q], [q_dot], constants=arm),
            "J": arm.J(q),
            "J_dot": arm.J_dot(q, q_dot),
        }

    return lifted(UNIT_ARM, {"q": 2, "q_dot": 2}, expressions)


@st.composite
def reachable(draw: st.DrawFn, arm: TwoLinkArm) -> np.ndarray:
    """Points of the workspace, drawn by their distance from the base rather than by a pose."""
    inner, outer = abs(arm.l1 - arm.l2), arm.l1 + arm.l2
    reach = inner + draw(between(0.01, 0.99)) * (outer - inner)
    bearing = draw(between(-np.pi, np.pi))
    return reach * np.array([np.cos(bearing), np.sin(bearing)])


@given(st.data(), arms(), ELBOWS)
def test_forward_after_inverse_is_the_identity_for_both_elbows(data, arm, elbow):
    x = data.draw(reachable(arm))
    q = arm.inverse(x, elbow)
    assert np.sign(q[1]) == (1 if elbow == "+" else -1)
    np.testing.assert_allclose(arm.x_r(q), x, atol=1e-13)


@given(arms(), poses())
def test_inverse_after_forward_is_the_identity_up_to_whole_turns(arm, q):
    found = arm.inverse(arm.x_r(q), "+" if q[1] > 0 else "-")
    turns = (found - q) / (2 * np.pi)
    np.testing.assert_allclose(turns, np.round(turns), atol=1e-13)
    assert round(turns[1]) == 0


@given(arms(), poses())
def test_the_two_elbows_are_mirror_images_about_the_line_to_the_tip(arm, q):
    x = arm.x_r(q)
    plus, minus = arm.inverse(x, "+"), arm.inverse(x, "-")
    assert plus[1] == -minus[1]
    elbows = [arm.l1 * np.exp(1j * solution[0]) for solution in (plus, minus)]
    along = (x[0] + 1j * x[1]) / np.hypot(*x)
    np.testing.assert_allclose(elbows[0] / along, np.conj(elbows[1] / along), atol=1e-13)


@given(arms(), between(-np.pi, np.pi), between(1e-6, 10.0), ELBOWS)
def test_positions_beyond_the_reach_are_refused_with_position_and_reach(arm, bearing, beyond, side):
    reach = arm.l1 + arm.l2 + beyond
    x = reach * np.array([np.cos(bearing), np.sin(bearing)])
    with pytest.raises(Unreachable) as refusal:
        arm.inverse(x, side)
    assert isinstance(refusal.value, AlightError) and isinstance(refusal.value, ValueError)
    for number in (*x, abs(arm.l1 - arm.l2), arm.l1 + arm.l2):
        assert f"{number:g}" in str(refusal.value)


@given(arms(), between(-np.pi, np.pi), between(0.0, 0.99), ELBOWS)
def test_positions_in_the_hole_about_the_base_are_refused(arm, bearing, share, side):
    hole = share * abs(arm.l1 - arm.l2)
    with pytest.raises(Unreachable):
        arm.inverse(hole * np.array([np.cos(bearing), np.sin(bearing)]), side)


@given(arms(), between(-np.pi, np.pi), st.sampled_from([0.0, np.pi]), ELBOWS)
def test_singular_poses_are_refused(arm, q1, q2, side):
    assume(q2 == 0.0 or arm.l1 != arm.l2)
    with pytest.raises(Unreachable, match="singular"):
        arm.inverse(arm.x_r(np.array([q1, q2])), side)


@pytest.mark.parametrize("elbow", ["left", "", "+-", "−", 1, -1, None])
def test_an_unknown_elbow_is_refused_with_the_known_ones(elbow):
    with pytest.raises(
        UnknownName, match=f"unknown elbow {re.escape(repr(elbow))}; one of: "
    ) as refusal:
        UNIT_ARM.inverse((0.5, 0.5), elbow)
    assert refusal.value.allowed == ["+", "-"] and refusal.value.name == elbow


@pytest.mark.parametrize("bad", [(np.nan, 0.3), (0.3, np.inf), (0.0, 0.0)])
def test_positions_that_are_no_place_for_the_tip_are_refused(bad):
    with pytest.raises(Unreachable):
        UNIT_ARM.inverse(bad, "+")


@given(arms(), poses(margin=0.0), rates())
def test_jacobian_and_its_rate_are_the_closed_forms(arm, q, q_dot):
    found = kinematics()(arm, q, q_dot)
    s1, c1, s12, c12 = np.sin(q[0]), np.cos(q[0]), np.sin(q.sum()), np.cos(q.sum())
    J = [[-arm.l1 * s1 - arm.l2 * s12, -arm.l2 * s12], [arm.l1 * c1 + arm.l2 * c12, arm.l2 * c12]]
    d1, d12 = q_dot[0], q_dot.sum()
    J_dot = [
        [-arm.l1 * c1 * d1 - arm.l2 * c12 * d12, -arm.l2 * c12 * d12],
        [-arm.l1 * s1 * d1 - arm.l2 * s12 * d12, -arm.l2 * s12 * d12],
    ]
    np.testing.assert_allclose(found["J"], J, atol=1e-14)
    np.testing.assert_allclose(found["J_dot"], J_dot, atol=1e-13)


@given(arms(), poses(margin=0.0), rates())
def test_tip_velocity_is_J_q_dot(arm, q, q_dot):  # (2)
    found = kinematics()(arm, q, q_dot)
    np.testing.assert_allclose(found["x_r_dot"], found["J"] @ q_dot, atol=1e-13)


@given(arms(), poses(margin=0.0))
def test_the_jacobian_is_singular_exactly_where_the_elbow_is_straight_or_folded(arm, q):
    det = np.linalg.det(arm.J(q))
    assert det == pytest.approx(arm.l1 * arm.l2 * np.sin(q[1]), abs=1e-14)


@given(arms(), poses(), rates())
def test_numbers_and_expressions_give_the_same_kinematics(arm, q, q_dot):
    found = kinematics()(arm, q, q_dot)
    numeric = {"x_r": arm.x_r(q), "J": arm.J(q), "J_dot": arm.J_dot(q, q_dot)}
    for name, value in numeric.items():
        np.testing.assert_allclose(value, found[name], rtol=0, atol=1e-13, err_msg=name)
