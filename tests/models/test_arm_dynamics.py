"""Properties 1-3, (9) and (10), of the arm in joint and in task space; gravity and friction."""

from __future__ import annotations

import functools
from typing import Any

import casadi as ca
import numpy as np
import pytest
from hypothesis import given

from alight.errors import ExpressionError, InvalidParameters
from alight.models import TwoLinkArm
from alight.symbolic import ops
from alight.symbolic.derive import jacobian, regressor, time_derivative
from alight.symbolic.parameters import rebind
from tests.lifted import Evaluate, lifted
from tests.strategies import Plane, arms, between, poses, rates, vectors

EPS = np.finfo(float).eps


def unit_arm(plane: Plane) -> TwoLinkArm:
    return TwoLinkArm(l1=1.0, l2=1.0, p1=3.0, p2=1.0, p3=0.5, plane=plane)


@functools.cache
def dynamics(plane: Plane) -> Evaluate:
    def kinetic(arm: Any, q_dot: Any, q: Any) -> Any:
        return ops.dot(q_dot, arm.M(q) @ q_dot) / 2

    def expressions(arm: Any, q: Any, q_dot: Any, tau: Any, force: Any) -> dict[str, Any]:
        q_ddot = arm.acceleration(q, q_dot, tau, force)
        return {
            "M": arm.M(q),
            "M_dot": time_derivative(arm.M, [q], [q_dot], constants=arm),
            "C": arm.C(q, q_dot),
            "h": arm.h(q),
            "friction": arm.friction(q_dot),
            "kinetic_slope": jacobian(lambda at: kinetic(arm, q_dot, at), q).T,
            "J": arm.J(q),
            "M_bar": arm.M_bar(q),
            "M_bar_dot": time_derivative(arm.M_bar, [q], [q_dot], constants=arm),
            "C_bar": arm.C_bar(q, q_dot),
            "h_bar": arm.h_bar(q),
            "q_ddot": q_ddot,
            "x_r_dot": arm.J(q) @ q_dot,
            "x_r_ddot": arm.J(q) @ q_ddot + arm.J_dot(q, q_dot) @ q_dot,
        }

    return lifted(unit_arm(plane), {"q": 2, "q_dot": 2, "tau": 2, "force": 2}, expressions)


def at(arm: TwoLinkArm, q: Any, q_dot: Any = (0, 0), tau: Any = (0, 0), force: Any = (0, 0)) -> Any:
    return dynamics(arm.plane)(arm, q, q_dot, tau, force)


def assert_positive_definite(matrix: np.ndarray) -> None:
    scale = np.abs(matrix).max()
    np.testing.assert_allclose(matrix, matrix.T, atol=10 * EPS * scale)
    np.linalg.cholesky((matrix + matrix.T) / 2)  # raises where it is not positive definite


# Property 1


@given(arms(), poses(margin=0.0))
def test_inertia_is_symmetric_and_positive_definite_in_every_pose(arm, q):
    assert_positive_definite(arm.M(q))


@given(arms(), poses(margin=0.05))
def test_task_space_inertia_is_symmetric_and_positive_definite_away_from_singularities(arm, q):
    assert_positive_definite(at(arm, q)["M_bar"])


@given(arms(), poses(), between(-np.pi, np.pi))
def test_bounds_of_task_space_inertia_depend_on_the_elbow_only(arm, q, turn):  # (9)
    here, turned = (np.linalg.eigvalsh(at(arm, pose)["M_bar"]) for pose in (q, q + [turn, 0.0]))
    np.testing.assert_allclose(here, turned, rtol=1e-10)


@given(arms(), poses())
def test_mobility_of_the_tip_is_J_M_inverse_J_transposed(arm, q):
    found = at(arm, q)
    mobility = found["J"] @ np.linalg.solve(found["M"], found["J"].T)
    np.testing.assert_allclose(found["M_bar"] @ mobility, np.eye(2), atol=1e-9)


# Property 2


@given(arms(), poses(margin=0.0), rates(), vectors(2, 1.0))
def test_half_the_rate_of_the_inertia_minus_coriolis_is_skew(arm, q, q_dot, xi):
    found = at(arm, q, q_dot)
    defect = found["M_dot"] / 2 - found["C"]
    assert abs(xi @ defect @ xi) <= 1e-13 * np.abs(found["C"]).max()
    np.testing.assert_allclose(defect, -defect.T, atol=1e-13 * np.abs(found["C"]).max())


@given(arms(), poses(), rates(), vectors(2, 1.0))
def test_the_same_holds_in_task_space(arm, q, q_dot, xi):  # (10)
    found = at(arm, q, q_dot)
    defect = found["M_bar_dot"] / 2 - found["C_bar"]
    assert abs(xi @ defect @ xi) <= 1e-11 * np.abs(found["C_bar"]).max()


@given(arms(), poses(margin=0.0), rates())
def test_coriolis_torque_is_that_of_lagranges_equations(arm, q, q_dot):
    found = at(arm, q, q_dot)
    lagrange = found["M_dot"] @ q_dot - found["kinetic_slope"]
    scale = np.abs(found["C"]).max() * np.abs(q_dot).max()
    np.testing.assert_allclose(found["C"] @ q_dot, lagrange, atol=1e-13 * scale)


# (1) and (5)


@given(arms("vertical", friction=True), poses(), rates(), vectors(2, 50.0), vectors(2, 100.0))
def test_accelerations_satisfy_the_joint_space_dynamics(arm, q, q_dot, tau, force):  # (1)
    found = at(arm, q, q_dot, tau, force)
    driven = tau - found["friction"] - found["J"].T @ force
    resisting = found["M"] @ found["q_ddot"] + found["C"] @ q_dot + found["h"]
    scale = np.abs(tau).max() + np.abs(force).max() + np.abs(resisting).max() + 1.0
    np.testing.assert_allclose(resisting, driven, atol=1e-11 * scale)


@given(arms("vertical"), poses(), rates(), vectors(2, 50.0), vectors(2, 100.0))
def test_task_space_dynamics_are_the_joint_space_ones(arm, q, q_dot, tau, force):  # (5)
    found = at(arm, q, q_dot, tau, force)
    terms = (
        found["M_bar"] @ found["x_r_ddot"],
        found["C_bar"] @ found["x_r_dot"],
        found["h_bar"],
        force,
        -np.linalg.solve(found["J"].T, tau),
    )
    scale = max(np.abs(term).max() for term in terms) + np.abs(found["M_bar"]).max()
    np.testing.assert_allclose(sum(terms), 0.0, atol=1e-9 * scale)


# Property 3


@given(arms("vertical"), poses(), rates(3.0), vectors(2, 5.0), between(0.0, 1e6))
def test_task_space_dynamics_are_linear_in_inertia_gravity_and_contact_stiffness(
    arm, q, q_dot, x_r_ddot, K_I
):
    names = arm.inertial + arm.gravitational
    penetration = 1e-3  # [m]

    def force(pi: Any) -> Any:
        other = arm.with_inertia(pi)
        x_r_dot = arm.J(q) @ q_dot
        motion = other.M_bar(q) @ x_r_ddot + other.C_bar(q, q_dot) @ x_r_dot + other.h_bar(q)
        return motion + ops.vector(pi[len(names)] * penetration, 0.0)

    Y = regressor(force, lambda pi: pi, len(names) + 1)
    theta = np.array([*(getattr(arm, name) for name in names), K_I])
    terms = np.abs(Y) @ np.abs(theta)
    np.testing.assert_allclose(Y @ theta, force(theta), atol=1e-11 * terms.max())
    assert np.isfinite(Y).all() and not isinstance(Y, ca.SX)


@pytest.mark.parametrize("geometry", ["l1", "l2"])
def test_dynamics_are_not_linear_in_the_geometry_and_the_regressor_says_so(geometry):
    q, x_r_ddot = np.array([0.3, 1.1]), np.array([1.0, -2.0])
    with pytest.raises(ExpressionError, match="not linear"):
        regressor(
            lambda pi: rebind(unit_arm("horizontal"), **{geometry: pi[0]}).M_bar(q) @ x_r_ddot,
            lambda pi: pi,
            1,
        )


# Conservative forces


@given(arms("vertical"), poses(margin=0.0))
def test_gravity_is_the_slope_of_the_height_of_the_masses(arm, q):
    def potential(at: Any) -> Any:
        return arm.g1 * ops.sin(at[0]) + arm.g2 * ops.sin(at[0] + at[1])

    np.testing.assert_allclose(arm.h(q), np.ravel(jacobian(potential, q)), rtol=0, atol=1e-11)


@given(arms("vertical"), poses(margin=0.0))
def test_gravity_has_a_potential_because_its_slope_is_symmetric(arm, q):
    slope = jacobian(arm.h, q)
    np.testing.assert_allclose(slope, slope.T, atol=1e-11)


@given(arms("vertical"))
def test_gravity_does_no_torque_on_an_arm_that_stands_or_hangs_straight(arm):
    for q1 in (-np.pi / 2, np.pi / 2):
        scale = arm.g1 + arm.g2
        np.testing.assert_allclose(arm.h(np.array([q1, 0.0])), 0.0, atol=2 * EPS * scale)


@given(arms("horizontal"), poses())
def test_there_is_no_gravity_in_the_horizontal_plane(arm, q):
    found = at(arm, q)
    assert not arm.h(q).any() and not found["h"].any() and not found["h_bar"].any()
    assert arm.gravitational == ()


# Joint friction


@given(arms(friction=True), rates())
def test_joint_friction_opposes_the_motion(arm, q_dot):
    assert (arm.friction(q_dot) * q_dot >= 0).all()
    assert not arm.friction(np.zeros(2)).any()


@given(arms(friction=True), rates())
def test_joint_friction_is_viscous_plus_coulomb_once_the_joint_moves(arm, q_dot):
    q_dot = q_dot + np.where(q_dot < 0, -20, 20) * arm.coulomb_speed
    full = np.array(arm.viscous) * q_dot + np.array(arm.coulomb) * np.sign(q_dot)
    np.testing.assert_allclose(arm.friction(q_dot), full, rtol=1e-12)


def test_at_the_coulomb_speed_76_percent_of_the_coulomb_friction_act():
    arm = rebind(unit_arm("horizontal"), coulomb=(2.0, 3.0), coulomb_speed=0.05)
    np.testing.assert_allclose(arm.friction(np.array([0.05, 0.05])), [1.52, 2.28], rtol=5e-3)


# What is refused


@given(between(0.05, 5.0), between(0.05, 5.0), between(-3.0, 3.0))
def test_an_arm_is_accepted_exactly_when_its_inertia_is_positive_definite(p1, p2, p3):
    elbows = [np.array([0.0, q2]) for q2 in (0.0, np.pi)]
    definite = min(
        np.linalg.eigvalsh(rebind(unit_arm("horizontal"), p1=p1, p2=p2, p3=p3).M(q))[0]
        for q in elbows
    )
    try:
        TwoLinkArm(l1=1.0, l2=1.0, p1=p1, p2=p2, p3=p3)
    except InvalidParameters as refusal:
        assert definite <= 1e-12
        for number in (p1, p2, p3):
            assert str(number) in str(refusal)
    else:
        assert definite >= -1e-12


def test_gravity_in_a_horizontal_plane_is_refused():
    with pytest.raises(InvalidParameters, match="g1 and g2 must be 0 in a horizontal plane"):
        TwoLinkArm(l1=1.0, l2=1.0, p1=3.0, p2=1.0, p3=0.5, g1=1.0)
