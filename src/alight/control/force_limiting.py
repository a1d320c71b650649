"""The paper's law, (32)."""

from __future__ import annotations

from alight.control.adaptive import AdaptiveContactLaw
from alight.symbolic.ops import Scalar, Vector, as_vector, log_cosh, tanh, total
from alight.symbolic.parameters import parameters


@parameters
class ForceLimiting(AdaptiveContactLaw):
    """The force-limiting adaptive law, (32): all feedback passes through tanh."""

    def feedback(self, e_r: Vector, r_r: Vector) -> Vector:
        """``Tanh(e_r) + k3 Tanh(r_r)`` [N], never above ``1 + k3`` per axis."""
        return tanh(e_r) + as_vector(self.gains.k3) * tanh(r_r)

    def potential(self, e_r: Vector) -> Scalar:
        """``ln cosh(e_r1) + ln cosh(e_r2)`` of (47) [J]."""
        return total(log_cosh(e_r))
