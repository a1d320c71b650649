"""What the feedback of a law can add to the tip force and to the joint torques."""

from __future__ import annotations

import itertools

import casadi as ca
import numpy as np

from alight.control import AdaptiveContactLaw
from alight.models.arm import Arm
from alight.symbolic.build import build

FAR = 1e6
"""An error [m, m/s] at which every saturation has been reached."""
ELBOWS = np.linspace(-np.pi, np.pi, 1441)
"""Elbow angles that stand for all poses [rad]; 0, where the reach is largest, is among them."""


def feedback_within(law: AdaptiveContactLaw, e_r: np.ndarray, r_r: np.ndarray) -> np.ndarray:
    """Largest feedback force [N] per axis while ``|e_r|`` and ``|r_r|`` stay within bounds.

    The feedback of each axis is taken to rise with both of its errors, as in (32) and (44), so
    that the largest magnitude stands at a corner.

    Parameters
    ----------
    law : AdaptiveContactLaw
        Its ``feedback`` is evaluated.
    e_r, r_r : (2,) array
        Bounds of the errors per axis [m, m/s].
    """
    signs = itertools.product((-1.0, 1.0), repeat=2)
    return np.max([np.abs(law.feedback(a * e_r, b * r_r)) for a, b in signs], axis=0)


def feedback_limit(law: AdaptiveContactLaw) -> np.ndarray | None:
    """Largest feedback force [N] per axis, whatever the errors; None if it grows with them.

    ``1 + k3`` for (32).
    """
    far = np.full(2, FAR)
    limit = feedback_within(law, far, far)
    beyond = feedback_within(law, 2 * far, 2 * far)
    return limit if np.allclose(beyond, limit, rtol=1e-12, atol=0) else None


def joint_limit(J: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Largest torque [N m] per joint, ``sum_i |J_ij| force_i``, of forces within ``+-force`` [N].

    ``J`` may hold many poses, shape (n, 2, 2).
    """
    return np.einsum("...ij,i->...j", np.abs(J), force)


def joint_limit_of_all_poses(arm: Arm, force: np.ndarray) -> np.ndarray:
    """Largest torque [N m] per joint of forces within ``+-force`` [N], over every pose.

    The base joint turns each column of ``J`` into any direction without changing its length; along
    ``force`` it yields most.
    """
    q2 = ca.SX.sym("q2")
    J = build("J", {"q2": q2}, {"J": arm.J(ca.vertcat(0.0, q2))})
    columns = np.asarray(J.map(ELBOWS.size)(ELBOWS[None, :])).T.reshape(-1, 2, 2)
    return np.linalg.norm(columns, axis=2).max(axis=0) * np.linalg.norm(force)
