"""The comparison law of [28], (44)."""

from __future__ import annotations

from alight.control.adaptive import AdaptiveContactLaw
from alight.symbolic.ops import Scalar, Vector, as_vector, dot
from alight.symbolic.parameters import parameters


@parameters
class Unsaturated(AdaptiveContactLaw):
    """The adaptive law without saturated feedback, (44)."""

    def feedback(self, e_r: Vector, r_r: Vector) -> Vector:
        """``e_r + k3 r_r`` [N]."""
        return e_r + as_vector(self.gains.k3) * r_r

    def potential(self, e_r: Vector) -> Scalar:
        """``e_r^T e_r / 2`` [J]."""
        return dot(e_r, e_r) / 2
