"""Where the sampled loop is linearised: at rest in contact, and at rest in free motion."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any, Literal

import casadi as ca
import numpy as np

from alight.control import AdaptiveContactLaw, AdaptiveState, Measurement
from alight.control.transition import Errors
from alight.errors import AlightError
from alight.models import LinearSpring, Plant, PlantState
from alight.models.arm import Elbow
from alight.symbolic.build import build
from alight.symbolic.ops import Scalar, as_expression
from alight.symbolic.parameters import lift, values_of
from alight.symbolic.signals import Layout
from alight.theory.lyapunov import ideal_measurement
from alight.theory.proven.filter_domain import filter_room
from alight.theory.proven.first_contact import resting_filter
from alight.theory.sampled.shape import Shape

Phase = Literal["contact", "free motion"]


@dataclass(frozen=True)
class Rest:
    """Plant and law at rest in one phase of the contact."""

    phase: Phase
    plant: Plant
    law: AdaptiveContactLaw
    s: PlantState
    a: AdaptiveState
    excited: slice
    """The entries of ``theta_r`` whose columns of ``Y_r`` are not zero here."""

    @property
    def pressing(self) -> float:
        """How the plant holds its contact: 1 closed, 0 open."""
        return 1.0 if self.phase == "contact" else 0.0

    @property
    def tau(self) -> np.ndarray:
        """Joint torques of the law [N m], shape (2,)."""
        memory = Layout(self.law.states).pack(self.a._asdict())
        tau = _torque(Shape.of(self.law))(self.s.q, self.s.x_m, memory, values_of(self.law))
        return np.asarray(tau).ravel()


# Kept, as those of `alight.theory.sampled.linear` are.
@functools.lru_cache(maxsize=16)
def _torque(shape: Shape) -> ca.Function:
    """Torque of a law at rest, from angles, position of the mass, the law's state and numbers."""
    lifted, layout = lift(shape.law), Layout(shape.law.states)
    q, x_m, memory = ca.SX.sym("q", 2), ca.SX.sym("x_m"), ca.SX.sym("memory", layout.size)
    seen = ideal_measurement(PlantState(q, np.zeros(2), x_m, 0.0, 0.0))
    tau = as_expression(lifted.obj.flow(layout.unpack(memory), seen).tau)
    inputs = {"q": q, "x_m": x_m, "memory": memory, "p": lifted.symbols}
    return build("torque", inputs, {"tau": tau})


def rest_in_contact(plant: Plant, law: AdaptiveContactLaw, elbow: Elbow) -> Rest:
    """Rest on the set point with true parameters.

    A contact that is no linear spring is known to the law by its stiffness there, force over
    penetration.

    Raises
    ------
    AlightError
        If the set point does not compress the spring, the tip cannot be where it asks for, or the
        true parameters lie outside their bounds.
    """
    gap, a = _truth(plant, law)
    target = law.target
    tip = np.array([target.x_md + gap, target.x_rd2])
    s = PlantState(plant.arm.inverse(tip, elbow), np.zeros(2), target.x_md, 0.0, 0.0)
    return Rest("contact", plant, law, s, a, slice(None))


def _truth(plant: Plant, law: AdaptiveContactLaw) -> tuple[float, AdaptiveState]:
    """Penetration at the set point [m], and the law's state there with true parameters."""
    body = plant.body
    force = -body.m * body.acceleration(law.target.x_md, 0.0, 0.0)
    gap = _penetration(plant, force)
    known = Plant(plant.arm, body, LinearSpring(K_I=force / gap))
    a = AdaptiveState(0.0, known.theta_dk, law.theta_r_of(law.pi_of(known)))
    _refuse_outside(law, a)
    return gap, a


def _penetration(plant: Plant, force: float) -> float:
    """Deflection [m] at which the contact gives a force [N] at rest."""
    from scipy.optimize import brentq  # a third of a second, which an import need not cost

    def excess(gap: float) -> float:
        return float(plant.contact.force(gap, 0.0, 1.0)) - force

    if not excess(0.0) < 0 < excess(1.0):
        raise AlightError(
            f"no rest in contact: the spring asks for {force:.3g} N at the set point, which no "
            "penetration between 0 and 1 m gives; set target.x_md beyond plant.body.x_0"
        )
    return float(brentq(excess, 0.0, 1.0, xtol=1e-300, rtol=1e-15))


def _refuse_outside(law: AdaptiveContactLaw, a: AdaptiveState) -> None:
    """Refuse true parameters at which a projection acts: the loop does not rest there."""
    for name, box, value in (
        ("theta_dk", law.theta_dk, a.theta_dk_hat),
        ("theta_r", law.theta_r, a.theta_r_hat),
    ):
        low, high = np.asarray(box.lower), np.asarray(box.upper)
        if np.any(value < low) or np.any(value > high):
            raise AlightError(
                f"no rest at the true parameters: they lie outside the bounds of law.{name}"
            )


def rest_in_free_motion(plant: Plant, law: AdaptiveContactLaw, elbow: Elbow) -> Rest:
    """Rest of mass, filter and tip in a free motion that is continued past the surface.

    The whole loop has no rest before contact: the desired tip position comes to rest behind the
    surface (Proposition C). Here nothing is touched there: the plant holds its contact open, and
    the law is shown an open gap. Of ``theta_r`` gravity alone is excited; every other column of
    ``Y_r`` is zero at rest at ``x_0``.

    Raises
    ------
    AlightError
        If the filter has no rest within its domain, the arm cannot reach the place of rest, or as
        `rest_in_contact`: the true parameters are those that contact shows.
    """
    x_0 = plant.body.x_0
    if filter_room(law.gains, law.target.x_md - x_0, 0.0) <= 0:
        raise AlightError(
            "no rest in free motion: the filter state reaches 1 while the mass rests at x_0; "
            "make alpha1 tanh(x_md - x_0) smaller than alpha2"
        )
    a = _truth(plant, law)[1]._replace(u_f=resting_filter(law))
    tip = np.array([law.x_rd1(x_0, a.u_f, a.theta_dk_hat), law.target.x_rd2])
    s = PlantState(plant.arm.inverse(tip, elbow), np.zeros(2), x_0, 0.0, 0.0)
    weights = slice(len(a.theta_r_hat) - len(plant.arm.gravitational), None)
    return Rest("free motion", plant, parted(law), s, a, weights)


def parted(law: AdaptiveContactLaw) -> AdaptiveContactLaw:
    """The same law, to which tip and mass always seem a metre apart."""
    made: Any = object.__new__(_parted_class(type(law)))
    made.__dict__.update(law.__dict__)
    return made


@functools.cache
def _parted_class(law: type[AdaptiveContactLaw]) -> type[AdaptiveContactLaw]:
    class Parted(law):  # type: ignore[misc, valid-type]
        def errors(self, measured: Measurement, u_f: Scalar, theta_dk_hat: Scalar) -> Errors:
            seen: Errors = super().errors(measured, u_f, theta_dk_hat)
            return seen._replace(gap=-1.0)

    return Parted
