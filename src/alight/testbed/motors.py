"""The direct-drive motors of Section V."""

from __future__ import annotations

from typing import Annotated

from alight.symbolic.ops import Vector, as_vector, maximum, minimum
from alight.symbolic.parameters import PositivePair, Quantity, parameters


@parameters
class Motors:
    """Motors in torque mode, which clip; a lower artificial limit may be set (Section V-B)."""

    limit: Annotated[PositivePair, Quantity("N m", "largest torque of each motor")] = (240.0, 20.0)
    artificial_limit: Annotated[
        PositivePair | None, Quantity("N m", "lower limit set in software; none if absent")
    ] = None

    def clip(self, tau: Vector) -> Vector:
        """Torque that reaches the joints [N m], shape (2,)."""
        bound = as_vector(self.limit)
        if self.artificial_limit is not None:
            bound = minimum(bound, as_vector(self.artificial_limit))
        return minimum(maximum(tau, -bound), bound)
