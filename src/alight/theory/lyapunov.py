"""The Lyapunov functions: (47) of the paper, and the part of it that decreases unconditionally."""

from __future__ import annotations

from alight.control.adaptive import AdaptiveContactLaw, AdaptiveState
from alight.control.measurement import Measurement
from alight.control.transition import Errors
from alight.models import Plant, PlantState
from alight.symbolic.ops import Scalar, as_vector, dot, log1p, log_cosh, total


def ideal_measurement(s: PlantState) -> Measurement:
    """What perfect sensors show in a state of the plant."""
    return Measurement(s.q, s.q_dot, s.x_m, s.x_m_dot)


def errors_at(law: AdaptiveContactLaw, s: PlantState, a: AdaptiveState) -> Errors:
    """Error system of a law in a state of plant and law."""
    return law.errors(ideal_measurement(s), a.u_f, a.theta_dk_hat)


def V_r(plant: Plant, law: AdaptiveContactLaw, s: PlantState, a: AdaptiveState) -> Scalar:
    """Robot part of (47) [J]: kinetic in ``r_r``, parameter error, ``ln cosh`` of ``e_r``.

    With (32) and the parameters of ``plant`` constant,
    ``V_r_dot <= -r_r^T k3 Tanh(r_r) - e_r^T alpha Tanh(e_r)`` for every positive gain, in contact,
    out of contact and through switching (finding F3 of the audit that the documentation
    summarises); the paper does not use it.
    """
    e = errors_at(law, s, a)
    theta_tilde = law.theta_r_of(law.pi_of(plant)) - a.theta_r_hat
    kinetic = dot(e.r_r, plant.arm.M_bar(s.q) @ e.r_r) / 2
    learning = dot(theta_tilde, theta_tilde / as_vector(law.Gamma_r)) / 2
    return kinetic + learning + total(log_cosh(e.e_r))


def V(plant: Plant, law: AdaptiveContactLaw, s: PlantState, a: AdaptiveState) -> Scalar:
    """Lyapunov function (47) [J], with ``theta_tilde`` where (47) prints a hat (erratum E4)."""
    g, m, K_I = law.gains, plant.body.m, plant.contact.K_I
    e = errors_at(law, s, a)
    theta_tilde = plant.theta_dk - a.theta_dk_hat
    stored = log_cosh(e.e_m) - log1p(-(a.u_f**2)) / 2  # ln cosh(e_f) in terms of u_f
    return (
        V_r(plant, law, s, a)
        + K_I * theta_tilde**2 / (2 * g.Gamma)
        + g.k2 * K_I * stored
        + dot(e.e_r, e.e_r)
        + m * e.eta_m**2 / 2
    )
