"""Arm, body, contact and friction together: the truth that a simulation integrates."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

import pydantic

from alight.models.arm import TwoLinkArm
from alight.models.body import MassSpring
from alight.models.contact import HuntCrossley, KelvinVoigt, LinearSpring
from alight.models.tip_friction import TipFriction
from alight.symbolic.ops import Scalar, Vector, dot, vector, where
from alight.symbolic.parameters import parameters
from alight.symbolic.signals import Signal

AnyContactLaw = Annotated[
    LinearSpring | KelvinVoigt | HuntCrossley, pydantic.Field(discriminator="type")
]


class PlantState(NamedTuple):
    """State of the plant."""

    q: Annotated[Any, Signal("rad", "joint angles", 2)]
    q_dot: Annotated[Any, Signal("rad/s", "joint rates", 2)]
    x_m: Annotated[Any, Signal("m", "position of the mass")]
    x_m_dot: Annotated[Any, Signal("m/s", "velocity of the mass")]
    z: Annotated[Any, Signal("m", "deflection of the friction bristle along X2")]


class Contact(NamedTuple):
    """What happens at the tip."""

    gap: Scalar
    """x_r1 - x_m [m]; negative in free motion."""
    Lambda: Scalar
    guard: Scalar
    """Zero or above just where the contact presses."""
    presses: Scalar
    """1 where the contact presses, else 0."""
    F_m: Scalar
    """Impact force (7) [N]."""
    F_t: Scalar
    """Friction force along X2 on the body [N]."""
    slip: Scalar
    """Speed of the tip along X2 [m/s]."""


@parameters
class Plant:
    """Physics (1)-(8) with the friction that the testbed had and the model has not."""

    arm: TwoLinkArm
    body: MassSpring
    contact: AnyContactLaw
    tip_friction: TipFriction = TipFriction()

    @property
    def theta_dk(self) -> Scalar:
        """Compliance ratio ``k_s / K_I`` of (20)."""
        return self.body.k_s / self.contact.K_I

    def touch(self, s: PlantState, pressing: Scalar | None = None) -> Contact:
        """Gap, indicator and forces of the contact in a state; see `rates` for ``pressing``."""
        x_r, x_r_dot = self.arm.x_r(s.q), self.arm.J(s.q) @ s.q_dot
        gap, gap_dot = x_r[0] - s.x_m, x_r_dot[0] - s.x_m_dot
        guard = self.contact.guard(gap, gap_dot)
        presses = where(guard >= 0, 1.0, 0.0) if pressing is None else pressing
        F_m = self.contact.force(gap, gap_dot, presses)
        F_t = self.tip_friction.force(s.z, x_r_dot[1], F_m)
        return Contact(gap, self.contact.Lambda(gap), guard, presses, F_m, F_t, x_r_dot[1])

    def rates(self, s: PlantState, tau: Vector, pressing: Scalar | None = None) -> PlantState:
        """Time derivative of the state under joint torques [N m]: (1), (5) and (6).

        With ``pressing`` 1 or 0 the contact is held closed or open, whatever the state: the smooth
        system of one phase, which an integrator follows up to the switch. If absent, the state
        decides.
        """
        touch = self.touch(s, pressing)
        return PlantState(
            q=s.q_dot,
            q_dot=self.arm.acceleration(s.q, s.q_dot, tau, vector(touch.F_m, touch.F_t)),
            x_m=s.x_m_dot,
            x_m_dot=self.body.acceleration(s.x_m, s.x_m_dot, touch.F_m),
            z=self.tip_friction.z_dot(s.z, touch.slip, touch.presses),
        )

    def energy(self, s: PlantState) -> Scalar:
        """Kinetic and elastic energy without that of gravity and the bristle [J]."""
        kinetic = dot(s.q_dot, self.arm.M(s.q) @ s.q_dot) / 2
        gap = self.arm.x_r(s.q)[0] - s.x_m
        return kinetic + self.contact.energy(gap) + self.body.energy(s.x_m, s.x_m_dot)
