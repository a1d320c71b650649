"""M, C, J, gravity and acceleration against Pinocchio, fed with masses and centres of mass.

Independent here: Pinocchio's recursive multibody algorithms, its kinematics, and the inertias,
which it gets link by link; Alight's ``p1, p2, p3, g1, g2`` are computed from the same links.
"""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from alight.models import TwoLinkArm
from tests.lifted import Evaluate, lifted
from tests.strategies import GRAVITY, Links, links, poses, rates, vectors

PRECISION = 1e-10
POSES = poses(margin=0.0)


class Oracle:
    """The arm as Pinocchio knows it: two hinges about the vertical of the plane X1-X2."""

    def __init__(self, of: Links, gravity: float) -> None:
        model = pin.Model()
        model.gravity.linear = np.array([0.0, -gravity, 0.0])
        joint, place = 0, pin.SE3.Identity()
        for i in range(2):
            joint = model.addJoint(joint, pin.JointModelRZ(), place, f"q{i + 1}")
            inertia = pin.Inertia(
                of.m[i], np.array([of.l_c[i], 0.0, 0.0]), of.inertia[i] * np.eye(3)
            )
            model.appendBodyToJoint(joint, inertia, pin.SE3.Identity())
            place = pin.SE3(np.eye(3), np.array([of.l[i], 0.0, 0.0]))
        self.tip = model.addFrame(pin.Frame("tip", joint, 0, place, pin.FrameType.OP_FRAME))
        self.model, self.data = model, model.createData()

    def M(self, q: np.ndarray) -> np.ndarray:
        upper = np.triu(pin.crba(self.model, self.data, q))
        return upper + np.triu(upper, 1).T

    def C(self, q: np.ndarray, q_dot: np.ndarray) -> np.ndarray:
        return pin.computeCoriolisMatrix(self.model, self.data, q, q_dot).copy()

    def x_r(self, q: np.ndarray) -> np.ndarray:
        pin.framesForwardKinematics(self.model, self.data, q)
        return self.data.oMf[self.tip].translation[:2].copy()

    def J(self, q: np.ndarray) -> np.ndarray:
        frame = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        return pin.computeFrameJacobian(self.model, self.data, q, self.tip, frame)[:2].copy()

    def J_dot(self, q: np.ndarray, q_dot: np.ndarray) -> np.ndarray:
        pin.computeJointJacobiansTimeVariation(self.model, self.data, q, q_dot)
        pin.framesForwardKinematics(self.model, self.data, q)
        frame = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        found = pin.getFrameJacobianTimeVariation(self.model, self.data, self.tip, frame)
        return found[:2].copy()

    def nle(self, q: np.ndarray, q_dot: np.ndarray) -> np.ndarray:
        """Coriolis, centrifugal and gravity torques together."""
        return pin.nonLinearEffects(self.model, self.data, q, q_dot).copy()

    def q_ddot(self, q: Any, q_dot: Any, tau: np.ndarray, tip_force: np.ndarray) -> np.ndarray:
        """Articulated-body algorithm; the reaction to ``tip_force`` acts at the tip."""
        pin.framesForwardKinematics(self.model, self.data, q)
        turned = self.data.oMi[2].rotation.T @ np.array([*-tip_force, 0.0])
        place = self.model.frames[self.tip].placement.translation
        forces = pin.StdVec_Force()
        for wrench in (np.zeros(6), np.zeros(6), np.hstack([turned, np.cross(place, turned)])):
            forces.append(pin.Force(wrench))
        return pin.aba(self.model, self.data, q, q_dot, tau, forces).copy()


@functools.cache
def alight_side(plane: str) -> Evaluate:
    def expressions(arm: Any, q: Any, q_dot: Any, tau: Any, tip_force: Any) -> dict[str, Any]:
        return {
            "x_r": arm.x_r(q),
            "J": arm.J(q),
            "J_dot": arm.J_dot(q, q_dot),
            "M": arm.M(q),
            "C": arm.C(q, q_dot),
            "nle": arm.C(q, q_dot) @ q_dot + arm.h(q),
            "q_ddot": arm.acceleration(q, q_dot, tau, tip_force),
        }

    template = TwoLinkArm(l1=1.0, l2=1.0, p1=3.0, p2=1.0, p3=0.5, plane=plane)
    return lifted(template, {"q": 2, "q_dot": 2, "tau": 2, "tip_force": 2}, expressions)


def assert_agree(found: np.ndarray, expected: np.ndarray, name: str) -> None:
    scale = max(1.0, float(np.abs(expected).max()))
    np.testing.assert_allclose(found, expected, rtol=0, atol=PRECISION * scale, err_msg=name)


PLANES = pytest.mark.parametrize(
    ("plane", "gravity"), [("horizontal", 0.0), ("vertical", GRAVITY)], ids=["flat", "upright"]
)


@PLANES
@given(links(), POSES, rates())
def test_kinematics_and_inertia_agree(plane, gravity, of, q, q_dot):
    found = alight_side(plane)(of.arm(plane), q, q_dot, np.zeros(2), np.zeros(2))
    oracle = Oracle(of, gravity)
    assert_agree(found["x_r"], oracle.x_r(q), "x_r")
    assert_agree(found["J"], oracle.J(q), "J")
    assert_agree(found["J_dot"], oracle.J_dot(q, q_dot), "J_dot")
    assert_agree(found["M"], oracle.M(q), "M")


@PLANES
@given(links(), POSES, rates())
def test_coriolis_and_gravity_torques_agree(plane, gravity, of, q, q_dot):
    found = alight_side(plane)(of.arm(plane), q, q_dot, np.zeros(2), np.zeros(2))
    assert_agree(found["nle"], Oracle(of, gravity).nle(q, q_dot), "C q_dot + h")


@given(links(), POSES, rates())
def test_the_coriolis_matrices_are_the_same_factorisation(of, q, q_dot):
    """Pinocchio's, too, makes M_dot - 2 C skew; with two joints that leaves no freedom here."""
    found = alight_side("horizontal")(of.arm(), q, q_dot, np.zeros(2), np.zeros(2))
    assert_agree(found["C"], Oracle(of, 0.0).C(q, q_dot), "C")


@PLANES
@given(links(), POSES, rates(), vectors(2, 50.0), vectors(2, 100.0))
def test_accelerations_under_torque_and_tip_force_agree(
    plane, gravity, of, q, q_dot, tau, tip_force
):
    found = alight_side(plane)(of.arm(plane), q, q_dot, tau, tip_force)
    expected = Oracle(of, gravity).q_ddot(q, q_dot, tau, tip_force)
    assert_agree(found["q_ddot"], expected, "q_ddot")


@given(st.data())
def test_the_oracle_would_notice_a_wrong_inertia(data):
    of, q = data.draw(links()), data.draw(POSES)
    wrong = Links(of.l, (of.m[0], of.m[1] * 1.01), of.l_c, of.inertia)
    assert np.abs(wrong.arm().M(q) - Oracle(of, 0.0).M(q)).max() > PRECISION
