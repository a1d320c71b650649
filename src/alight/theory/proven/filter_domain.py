"""Where the filter (18) cannot escape: the interval ``|u_f| < 1``.

At ``u_f = 1`` (18) leaves ``u_f_dot = -k1 eta_m``, and ``eta_m`` is positive there where
``alpha1 tanh(e_m) - x_m_dot > -alpha2``; likewise at ``u_f = -1``. The interval is therefore
invariant as long as ``|alpha1 tanh(e_m) - x_m_dot| < alpha2``. Where that fails ``e_f`` can escape
to infinity in finite time.
"""

from __future__ import annotations

from alight.control import Gains
from alight.control.error_system import eta_m
from alight.symbolic.ops import Scalar, fabs
from alight.theory.case import Case
from alight.theory.condition import Condition


def filter_room(gains: Gains, e_m: Scalar, x_m_dot: Scalar) -> Scalar:
    """``alpha2 - |alpha1 tanh(e_m) - x_m_dot|`` [m/s]; positive where ``|u_f| < 1`` is kept.

    At rest, with ``x_m_dot = 0``, it is also the speed of the mass [m/s] up to which the filter is
    safe at a position error ``e_m`` [m], whatever the direction.
    """
    return gains.alpha2 - fabs(eta_m(gains, e_m, x_m_dot, 0.0))


def filter_condition(case: Case) -> Condition:
    """Keep the filter within its domain before contact, the mass at its start."""
    load = case.law.gains.alpha2 - filter_room(case.law.gains, case.e.e_m, case.s.x_m_dot)
    return Condition(
        number="filter",
        statement="alpha2 > |alpha1 tanh(e_m(0)) - x_m_dot(0)|",
        left=case.law.gains.alpha2,
        relation=">",
        right=float(load),
        unit="m/s",
        meaning="While the mass has not moved the filter cannot escape: |u_f| stays below 1.",
    )
