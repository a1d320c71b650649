"""Mechanics that holds for every rigid arm."""

from __future__ import annotations

from collections.abc import Callable

import casadi as ca

from alight.symbolic.derive import evaluated
from alight.symbolic.ops import Matrix, Vector, as_expression


def christoffel(inertia: Callable[[Vector], Matrix], q: Vector, q_dot: Vector) -> Matrix:
    """Coriolis matrix of an inertia matrix, in the form that makes (10) hold.

    ``C_ij = sum_k (dM_ij/dq_k + dM_ik/dq_j - dM_jk/dq_i) q_dot_k / 2``, the Christoffel symbols of
    the first kind; other factorisations with the same ``C q_dot`` are not skew.

    Parameters
    ----------
    inertia : callable
        Inertia matrix as a function of ``q``, n x n [kg m^2].
    q, q_dot : (n,) vectors
        Joint angles [rad] and rates [rad/s].

    Returns
    -------
    (n, n) matrix [kg m^2/s]
    """

    def at(q: ca.SX, q_dot: ca.SX) -> ca.SX:
        n = q.numel()
        angles = ca.SX.sym("q", n)
        m = inertia(angles)
        slopes = [ca.jacobian(m[:, j], angles) for j in range(n)]  # slopes[j][i, k] = dM_ij/dq_k
        entry = [
            [
                sum(
                    (slopes[j][i, k] + slopes[k][i, j] - slopes[k][j, i]) * q_dot[k] / 2
                    for k in range(n)
                )
                for j in range(n)
            ]
            for i in range(n)
        ]
        c = ca.vertcat(*(ca.horzcat(*row) for row in entry))
        return ca.substitute(c, angles, as_expression(q))

    return evaluated(at, q, q_dot)
