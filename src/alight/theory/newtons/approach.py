"""The way to the first touch of a resting mass: explicit, but for the filter's time."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from alight.control import AdaptiveContactLaw
from alight.symbolic.build import build
from alight.theory.case import Case
from alight.theory.proven.first_contact import first_contact

STEPS = 4001
"""Filter states at which the way is looked at, from its start to its limit."""


@dataclass(frozen=True)
class Approach:
    """Desired trajectory before the first touch, over the filter state that sweeps it."""

    u_f: np.ndarray
    """From the start of the run to the limit of Proposition C; before contact it does not turn."""
    ahead: np.ndarray
    """``x_rd1 - x_m`` [m]."""
    x_rd1_dot: np.ndarray
    """Rate of the desired position [m/s]."""

    def fastest(self, alpha_1: float, r_1: float) -> float:
        """Largest speed of the tip [m/s] at the first touch while ``|r_r1| <= r_1``.

        ``x_r1_dot = x_rd1_dot - e_r1_dot = x_rd1_dot + alpha_1 e_r1 - r_r1`` by (17), and
        ``e_r1 = x_rd1 - x_m`` in the instant of touch.
        """
        return float((self.x_rd1_dot + alpha_1 * self.ahead).max()) + r_1


def approach(case: Case) -> tuple[Approach | None, str]:
    """The way to the first touch, or why it is not known."""
    limit = first_contact(case)
    if limit.u_inf is None:
        return None, limit.undefined
    if case.e.gap >= 0:
        return None, "the run starts in contact"
    u_f = np.linspace(case.a.u_f, limit.u_inf, STEPS)
    ahead, x_rd1_dot = (np.asarray(v).ravel() for v in _way(case.law).map(STEPS)(u_f[None, :]))
    return Approach(u_f, ahead, x_rd1_dot), ""


def _way(law: AdaptiveContactLaw) -> ca.Function:
    x_0, u_f = law.model.body.x_0, ca.SX.sym("u_f")
    start = float(law.theta_dk.initial)  # type: ignore[arg-type]
    outputs = {
        "ahead": law.x_rd1(x_0, u_f, start) - x_0,
        "x_rd1_dot": law.x_rd1_dot(x_0, 0.0, u_f, start),
    }
    return build("way", {"u_f": u_f}, outputs)
