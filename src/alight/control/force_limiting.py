"""The paper's law, (32)."""

from __future__ import annotations

from alight.control.adaptive import AdaptiveContactLaw
from alight.symbolic.ops import Vector, as_vector, tanh
from alight.symbolic.parameters import parameters


@parameters
class ForceLimiting(AdaptiveContactLaw):
    """The force-limiting adaptive law, (32): all feedback passes through tanh."""

    def feedback(self, e_r: Vector, r_r: Vector) -> Vector:
        """``Tanh(e_r) + k3 Tanh(r_r)`` [N], never above ``1 + k3`` per axis."""
        return tanh(e_r) + as_vector(self.gains.k3) * tanh(r_r)
