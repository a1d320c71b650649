"""The force between tip and body: (7)-(8) and two damped alternatives."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Annotated, Literal

import annotated_types as at

from alight.symbolic.ops import Scalar, fabs, maximum, minimum, where
from alight.symbolic.parameters import NonNegative, Positive, Quantity, parameters


class ContactLaw(ABC):
    """A unilateral contact along X1: the force pushes, and never pulls.

    A law states its force while it presses, and the guard whose sign says when it does. Both are
    smooth where the force itself has a kink or a jump, so that an integrator can follow one phase
    to the instant of the switch.
    """

    K_I: float

    def Lambda(self, gap: Scalar) -> Scalar:
        """Contact indicator (8): 1 where ``gap = x_r1 - x_m >= 0``, else 0."""
        return where(gap >= 0, 1.0, 0.0)

    def penetration(self, gap: Scalar) -> Scalar:
        """Deflection of the contact stiffness, ``Lambda (x_r1 - x_m)`` [m]."""
        return maximum(gap, 0.0)

    @abstractmethod
    def pressing(self, gap: Scalar, gap_dot: Scalar) -> Scalar:
        """Force [N] while the contact presses, continued smoothly to where it does not."""

    @abstractmethod
    def guard(self, gap: Scalar, gap_dot: Scalar) -> Scalar:
        """What is zero or above just where the contact presses; its sign alone has a meaning."""

    def force(self, gap: Scalar, gap_dot: Scalar, presses: Scalar | None = None) -> Scalar:
        """Impact force F_m [N] at the gap ``x_r1 - x_m`` [m] and its rate [m/s].

        ``presses``, 1 or 0, says whether the contact presses; if absent, the `guard` does.
        """
        closed = self.guard(gap, gap_dot) >= 0 if presses is None else presses > 0
        return where(closed, self.pressing(gap, gap_dot), 0.0)

    @abstractmethod
    def energy(self, gap: Scalar) -> Scalar:
        """Elastic energy stored in the contact [J]."""


@parameters
class LinearSpring(ContactLaw):
    """The paper's contact: ``F_m = K_I Lambda (x_r1 - x_m)``, (7)-(8)."""

    type: Annotated[Literal["linear-spring"], Quantity("", "contact law")] = "linear-spring"
    K_I: Annotated[Positive, Quantity("N/m", "contact stiffness")] = 1e5

    def pressing(self, gap: Scalar, gap_dot: Scalar) -> Scalar:
        """Force of (7) in contact [N]; it does not depend on the rate."""
        return self.K_I * gap

    def guard(self, gap: Scalar, gap_dot: Scalar) -> Scalar:
        """The same [N]."""
        return self.pressing(gap, gap_dot)

    def energy(self, gap: Scalar) -> Scalar:
        """Elastic energy stored in the contact [J]."""
        return self.K_I * self.penetration(gap) ** 2 / 2


@parameters
class KelvinVoigt(ContactLaw):
    """A spring beside a damper, cut off where it would pull.

    ``F_m = max(0, K_I gap + damping gap_dot)`` in contact, else 0.
    """

    type: Annotated[Literal["kelvin-voigt"], Quantity("", "contact law")] = "kelvin-voigt"
    K_I: Annotated[Positive, Quantity("N/m", "contact stiffness")] = 1e5
    damping: Annotated[NonNegative, Quantity("N s/m", "contact damping")] = 0.0

    def pressing(self, gap: Scalar, gap_dot: Scalar) -> Scalar:
        """``K_I gap + damping gap_dot`` [N]."""
        return self.K_I * gap + self.damping * gap_dot

    def guard(self, gap: Scalar, gap_dot: Scalar) -> Scalar:
        """The force of the spring or the whole force [N], whichever is less.

        Both in one unit: near the switch no kink is left, which a search for it would stumble over.
        """
        return minimum(self.K_I * gap, self.pressing(gap, gap_dot))

    def energy(self, gap: Scalar) -> Scalar:
        """Elastic energy stored in the contact [J]."""
        return self.K_I * self.penetration(gap) ** 2 / 2


@parameters
class HuntCrossley(ContactLaw):
    """``K_I gap^exponent (1 + dissipation gap_dot)``, never below 0, continuous at first touch.

    Hunt and Crossley, "Coefficient of restitution interpreted as damping in vibroimpact",
    J. Appl. Mech. 42(2), 1975.
    """

    type: Annotated[Literal["hunt-crossley"], Quantity("", "contact law")] = "hunt-crossley"
    K_I: Annotated[Positive, Quantity("N/m^exponent", "contact stiffness")] = 1e5
    exponent: Annotated[float, at.Ge(1), Quantity("", "1 for a flat punch, 1.5 for a sphere")] = 1.0
    dissipation: Annotated[NonNegative, Quantity("s/m", "damping per force and speed")] = 0.0

    def pressing(self, gap: Scalar, gap_dot: Scalar) -> Scalar:
        """``K_I gap^exponent (1 + dissipation gap_dot)`` [N], 0 outside of the body."""
        elastic = self.K_I * self.penetration(gap) ** self.exponent
        return elastic * (1 + self.dissipation * gap_dot)

    def guard(self, gap: Scalar, gap_dot: Scalar) -> Scalar:
        """``K_I gap (1 + dissipation gap_dot)``, below zero also where both factors are.

        It is smooth wherever one of them vanishes.
        """
        elastic, factor = self.K_I * gap, 1 + self.dissipation * gap_dot
        return minimum(elastic * factor, elastic * fabs(factor))

    def energy(self, gap: Scalar) -> Scalar:
        """Elastic energy stored in the contact [J]."""
        return self.K_I * self.penetration(gap) ** (self.exponent + 1) / (self.exponent + 1)
