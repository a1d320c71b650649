"""Bounds of the task-space inertia (9) over what is not known of the arm: inertias and poses."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass

import casadi as ca
import numpy as np

from alight.control import AdaptiveContactLaw
from alight.errors import AlightError
from alight.models.arm import Arm
from alight.symbolic.build import build

POSES = 1441
"""Elbow angles between -pi and pi at which an extreme is looked for before it is refined."""


@dataclass(frozen=True)
class InertiaBounds:
    """``a1 |xi|^2 <= xi^T M_bar xi <= a2 |xi|^2`` of (9), for every admitted inertia and pose."""

    a1: float
    """Lower bound [kg], over all poses: ``M_bar`` does not lose it near a singular one."""
    a2: float
    """Upper bound [kg], where no singular value of ``J`` is below that of Remark 1."""

    @property
    def mobility(self) -> float:
        """Upper bound of each diagonal entry of the inverse of ``M_bar`` [1/kg]."""
        return 1 / self.a1


def inertia_box(law: AdaptiveContactLaw) -> tuple[np.ndarray, np.ndarray]:
    """Bounds of the inertial parameters of the arm among those of ``theta_r``, (34)."""
    alone = slice(2, 3 * len(law.model.arm.inertial), 3)  # third of each block of three
    return np.array(law.theta_r.lower)[alone], np.array(law.theta_r.upper)[alone]


def inertia_bounds(
    arm: Arm, lower: np.ndarray, upper: np.ndarray, sigma_J: float, a1: float | None = None
) -> InertiaBounds:
    """Bound ``M_bar`` over a box of inertial parameters and all poses.

    The eigenvalues of ``M_bar`` depend on the elbow alone. ``M_bar`` is linear in the parameters
    and its inverse is convex in them, so that the extremes lie on corners of the box. Over the
    elbow they are found on a grid and refined.

    Parameters
    ----------
    arm : Arm
        Its kinematics are known.
    lower, upper : (n,) array
        Bounds of ``arm.inertial``; equal ones for a parameter that is known.
    sigma_J : float
        Smallest singular value of ``J`` that is admitted [m], Remark 1.
    a1 : float, optional
        Lower bound of ``M_bar`` that is known otherwise [kg]; a box that admits inertias which no
        arm has gives none.

    Raises
    ------
    AlightError
        If the box admits an inertia that is not positive definite and ``a1`` is not given, or if
        no pose is admitted.
    """
    corners = np.unique(list(itertools.product(*zip(lower, upper, strict=True))), axis=0)
    matrices = _matrices(arm)
    elbows = np.linspace(-np.pi, np.pi, POSES)

    admitted = _admitted(arm, elbows, sigma_J)
    least, heaviest = np.inf, 0.0
    for corner in corners:

        def mobility(q2: np.ndarray, at: np.ndarray = corner) -> np.ndarray:
            M, J = matrices(q2, at)
            return np.linalg.eigvalsh(J @ np.linalg.solve(M, J.transpose(0, 2, 1)))[:, -1]

        def inertia(q2: np.ndarray, at: np.ndarray = corner) -> np.ndarray:
            M, J = matrices(q2, at)
            inverse = np.linalg.inv(J)
            return np.linalg.eigvalsh(inverse.transpose(0, 2, 1) @ M @ inverse)[:, -1]

        heaviest = max(heaviest, _largest(inertia, admitted))
        if (np.linalg.eigvalsh(matrices(elbows, corner)[0])[:, 0] > 0).all():
            least = min(least, 1 / _largest(mobility, elbows))
        elif a1 is None:
            raise AlightError(_no_inertia(arm, corner))
        else:
            least = 0.0
    return InertiaBounds(a1=max(least, a1 or 0.0), a2=heaviest)


def _no_inertia(arm: Arm, corner: np.ndarray) -> str:
    named = ", ".join(f"{n} = {v:g}" for n, v in zip(arm.inertial, corner, strict=True))
    return (
        f"law.theta_r: its box admits {named}, an inertia matrix that is not positive definite; "
        "bring lower and upper closer together, or state assumptions.a1, the lower bound of M_bar"
    )


def _matrices(arm: Arm) -> Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """``M`` and ``J`` at many elbow angles, stacked, for given inertial parameters."""
    q2, p = ca.SX.sym("q2"), ca.SX.sym("p", len(arm.inertial))
    rest = [getattr(arm, name) for name in arm.gravitational]
    moved, q = arm.with_inertia(ca.vertcat(p, *rest)), ca.vertcat(0.0, q2)
    function = build("inertia", {"q2": q2, "p": p}, {"M": moved.M(q), "J": moved.J(q)})

    def at(elbows: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        rows = np.atleast_2d(elbows)
        found = function.map(rows.size)(rows, np.tile(values[:, None], rows.size))
        M, J = (np.asarray(v).reshape(2, -1, 2).transpose(1, 0, 2) for v in found)
        return M, J

    return at


def least_singular_values(arm: Arm, elbows: np.ndarray) -> np.ndarray:
    """Smaller singular value of ``J`` [m] at each of some elbow angles [rad]; the base is free."""
    known = np.array([getattr(arm, name) for name in arm.inertial], dtype=float)
    return np.linalg.svd(_matrices(arm)(elbows, known)[1], compute_uv=False)[:, -1]


def _admitted(arm: Arm, elbows: np.ndarray, sigma_J: float) -> np.ndarray:
    """Elbow angles whose Jacobian is regular enough, and the borders of that set."""
    from scipy.optimize import brentq  # a third of a second, which an import need not cost

    values = least_singular_values(arm, elbows)
    if values.max() < sigma_J:
        raise AlightError(
            f"assumptions.sigma_J = {sigma_J:g}: no pose has both singular values of J above it; "
            f"the largest smaller one is {values.max():.3g} m"
        )

    def excess(q2: float) -> float:
        return float(least_singular_values(arm, np.array([q2]))[0]) - sigma_J

    inside = values >= sigma_J
    borders = [
        brentq(excess, *elbows[i : i + 2]) for i in np.flatnonzero(inside[1:] != inside[:-1])
    ]
    return np.sort(np.concatenate([elbows[inside], borders]))


def _largest(value: Callable[[np.ndarray], np.ndarray], at: np.ndarray) -> float:
    """Largest value at the given angles, refined between the neighbours of the best."""
    from scipy.optimize import minimize_scalar

    found = value(at)
    best = int(found.argmax())
    low, high = at[max(best - 1, 0)], at[min(best + 1, len(at) - 1)]
    if high - low > 3 * (at[-1] - at[0]) / POSES or low == high:
        return float(found[best])  # across a gap between two parts of the admitted set
    refined = minimize_scalar(
        lambda q2: -float(value(np.array([q2]))[0]), bounds=(low, high), method="bounded"
    )
    return max(float(found[best]), -float(refined.fun))
