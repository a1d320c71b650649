"""The Lyapunov function (47), and the two parts of it that have a life of their own."""

from __future__ import annotations

from alight.control.adaptive import AdaptiveContactLaw, AdaptiveState
from alight.control.measurement import Measurement
from alight.control.transition import Errors
from alight.models import Plant, PlantState
from alight.symbolic.ops import Scalar, as_vector, dot, log1p, log_cosh


def ideal_measurement(s: PlantState) -> Measurement:
    """What perfect sensors show in a state of the plant."""
    return Measurement(s.q, s.q_dot, s.x_m, s.x_m_dot)


def errors_at(law: AdaptiveContactLaw, s: PlantState, a: AdaptiveState) -> Errors:
    """Error system of a law in a state of plant and law."""
    return law.errors(ideal_measurement(s), a.u_f, a.theta_dk_hat)


def V_r(plant: Plant, law: AdaptiveContactLaw, s: PlantState, a: AdaptiveState) -> Scalar:
    """Robot part of (47) [J]: kinetic in ``r_r``, parameter error, potential of ``e_r``.

    With the parameters of ``plant`` constant it falls at least by `dissipation` for every positive
    gain, in contact, out of contact and through switching: Proposition A, which the paper does not
    use. The potential is ``ln cosh`` for (32), a square for (44).
    """
    e = errors_at(law, s, a)
    theta_tilde = law.theta_r_of(law.pi_of(plant)) - a.theta_r_hat
    kinetic = dot(e.r_r, plant.arm.M_bar(s.q) @ e.r_r) / 2
    learning = dot(theta_tilde, theta_tilde / as_vector(law.Gamma_r)) / 2
    return kinetic + learning + law.potential(e.e_r)


def dissipation(law: AdaptiveContactLaw, e: Errors) -> Scalar:
    """By how much `V_r` falls at least [W].

    ``r_r^T k3 Tanh(r_r) + e_r^T alpha Tanh(e_r)`` for (32): the feedback of the velocity error
    times that error, and the feedback of the position error times ``alpha e_r``.
    """
    holding = law.feedback(e.e_r, 0 * e.r_r)
    damping = law.feedback(e.e_r, e.r_r) - holding
    return dot(e.r_r, damping) + dot(as_vector(law.gains.alpha) * e.e_r, holding)


def V_m(plant: Plant, law: AdaptiveContactLaw, s: PlantState, a: AdaptiveState) -> Scalar:
    """Mass part of (47) [J]: parameter error, filter and mass, ``eta_m``; of Proposition B."""
    g, m, K_I = law.gains, plant.body.m, plant.contact.K_I
    e = errors_at(law, s, a)
    theta_tilde = plant.theta_dk - a.theta_dk_hat
    stored = log_cosh(e.e_m) - log1p(-(a.u_f**2)) / 2  # ln cosh(e_f) in terms of u_f
    return K_I * theta_tilde**2 / (2 * g.Gamma) + g.k2 * K_I * stored + m * e.eta_m**2 / 2


def V(plant: Plant, law: AdaptiveContactLaw, s: PlantState, a: AdaptiveState) -> Scalar:
    """Lyapunov function (47) [J], with ``theta_tilde`` where (47) prints a hat (erratum E4)."""
    e_r = errors_at(law, s, a).e_r
    return V_r(plant, law, s, a) + dot(e_r, e_r) + V_m(plant, law, s, a)
