"""The error system (16)-(18), with the filter in the form that cannot overflow.

The paper's filter variable e_f enters only through ``tanh``, ``cosh`` and ``sinh``, and can reach
infinity in finite time. Alight integrates ``u_f = tanh(e_f)`` instead, in which (17), (18) and (25)
are polynomial or rational; ``|u_f| < 1`` is their domain.
"""

from __future__ import annotations

from alight.control.gains import Gains
from alight.symbolic.ops import Scalar, Vector, as_vector, tanh


def eta_m(g: Gains, e_m: Scalar, x_m_dot: Scalar, u_f: Scalar) -> Scalar:
    """Filtered error of the mass (17) [m/s]: ``e_m_dot + alpha1 tanh(e_m) + alpha2 tanh(e_f)``."""
    return -x_m_dot + g.alpha1 * tanh(e_m) + g.alpha2 * u_f


def r_r(g: Gains, e_r: Vector, e_r_dot: Vector) -> Vector:
    """Filtered tracking error of the tip (17) [m/s], shape (2,): ``e_r_dot + alpha e_r``."""
    return e_r_dot + as_vector(g.alpha) * e_r


def u_f_dot(g: Gains, e_m: Scalar, eta_m: Scalar, u_f: Scalar) -> Scalar:
    """Rate of the filter state [1/s]: (18) times ``d tanh(e_f)/d e_f = 1 - u_f^2``."""
    return (1 - u_f**2) * (g.alpha2 * tanh(e_m) - g.alpha3 * u_f) - g.k1 * eta_m


def cosh2_tanh(u_f: Scalar) -> Scalar:
    """``cosh^2(e_f) tanh(e_f)`` of (25), as ``u_f / (1 - u_f^2)``."""
    return u_f / (1 - u_f**2)
