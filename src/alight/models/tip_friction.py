"""Friction between tip and body along X2, with true sticking."""

from __future__ import annotations

from typing import Annotated

import annotated_types as at

from alight.symbolic.ops import Scalar, fabs, maximum, minimum, sin, where
from alight.symbolic.parameters import NonNegative, Positive, Quantity, parameters

_HALF_TURN = 3.141592653589793


@parameters
class TipFriction:
    """Single-state elastoplastic friction, scaled by the normal force.

    Below the break-away fraction of its full deflection the bristle is purely elastic: the tip
    sticks without the creep of the LuGre model, so that a steady-state error can persist.

    Dupont, Hayward, Armstrong and Altpeter, "Single state elastoplastic friction models", IEEE
    Trans. Autom. Control 47(5), 2002. The scaling by the normal force, the bounds on force
    and speed of the bristle, and its relaxation out of contact are our own.
    """

    mu: Annotated[NonNegative, Quantity("", "friction coefficient; 0 turns friction off")] = 0.0
    deflection: Annotated[
        Positive, Quantity("m", "bristle deflection at which the tip slides fully")
    ] = 1e-4
    damping: Annotated[NonNegative, Quantity("s", "bristle damping over bristle stiffness")] = 1e-3
    breakaway: Annotated[
        float, at.Gt(0), at.Lt(1), Quantity("", "fraction of the deflection that stays elastic")
    ] = 0.7
    response: Annotated[
        Positive, Quantity("s", "shortest time in which the bristle bends or relaxes")
    ] = 1e-3

    @property
    def _fastest(self) -> Scalar:
        """Largest speed of the bristle [m/s]."""
        return self.deflection / self.response

    def plasticity(self, z: Scalar, v: Scalar) -> Scalar:
        """Share of the motion that slides: 0 sticks, 1 slides fully (alpha of Dupont et al.)."""
        ratio = fabs(z) / self.deflection
        phase = minimum(maximum((ratio - self.breakaway) / (1 - self.breakaway), 0.0), 1.0)
        sliding = (1 + sin(_HALF_TURN * (phase - 0.5))) / 2
        return where(z * v > 0, sliding, 0.0)

    def z_dot(self, z: Scalar, v: Scalar, presses: Scalar) -> Scalar:
        """Rate of the bristle deflection ``z`` [m/s] at the sliding speed ``v`` [m/s].

        Without friction there is no bristle: it rests.

        The bristle follows no faster than ``deflection / response``: at such speeds it is fully
        deflected anyway, and a fixed step must be able to follow it.
        """
        followed = minimum(maximum(v, -self._fastest), self._fastest)
        sticking = followed * (1 - self.plasticity(z, v) * fabs(z) / self.deflection)
        return where(self.mu > 0, where(presses > 0, sticking, -z / self.response), 0.0)

    def force(self, z: Scalar, v: Scalar, F_m: Scalar) -> Scalar:
        """Force [N] on the body along X2 under the normal force ``F_m`` [N], within ``mu F_m``."""
        touching = where(F_m > 0, 1.0, 0.0)
        # a tip that runs back faster than the bristle follows must not be driven by it
        gripping = where(z * v < 0, self._fastest / maximum(fabs(v), self._fastest), 1.0)
        strain = (gripping * z + self.damping * self.z_dot(z, v, touching)) / self.deflection
        return self.mu * F_m * minimum(maximum(strain, -1.0), 1.0)
