"""What is struck: the mass on a spring, (3) and (6)."""

from __future__ import annotations

from typing import Annotated

from alight.symbolic.ops import Scalar
from alight.symbolic.parameters import NonNegative, Positive, Quantity, parameters


@parameters
class MassSpring:
    """The unactuated mass-spring body of (3), with optional viscous damping."""

    m: Annotated[Positive, Quantity("kg", "mass")]
    k_s: Annotated[Positive, Quantity("N/m", "stiffness of the spring")]
    x_0: Annotated[float, Quantity("m", "rest position")]
    damping: Annotated[NonNegative, Quantity("N s/m", "viscous damping of the mass")] = 0.0

    def Y_d(self, x_m: Scalar) -> Scalar:
        """Compression of the spring, ``x_m - x_0`` of (19) [m]."""
        return x_m - self.x_0

    def acceleration(self, x_m: Scalar, x_m_dot: Scalar, F_m: Scalar) -> Scalar:
        """Acceleration of the mass under the impact force ``F_m``, (6) [m/s^2]."""
        return (F_m - self.k_s * self.Y_d(x_m) - self.damping * x_m_dot) / self.m

    def energy(self, x_m: Scalar, x_m_dot: Scalar) -> Scalar:
        """Kinetic energy of the mass and potential energy of its spring [J]."""
        return (self.m * x_m_dot**2 + self.k_s * self.Y_d(x_m) ** 2) / 2
