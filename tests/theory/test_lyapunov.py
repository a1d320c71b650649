"""The Lyapunov functions at random states: sign, and what their rates are made of."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from numpy import tanh

from alight.control import AdaptiveContactLaw, AdaptiveState, ForceLimiting, Unsaturated
from alight.errors import AlightError
from alight.models import PlantState
from alight.symbolic.derive import jacobian
from alight.theory import V, V_r
from alight.theory.lyapunov import dissipation, errors_at
from tests.control.cases import TARGET, cases, told
from tests.control.closed_loop import evaluate
from tests.paper.typed import agree, scope, sech2
from tests.strategies import vectors


def falls_of_32(v):
    """``r^T k3 Tanh(r) + e_r^T alpha Tanh(e_r)``, in its two parts."""
    return v.r_r @ (v.k3 * tanh(v.r_r)), v.e_r @ v.alpha @ tanh(v.e_r)


def size_of_V_r_dot(v):
    """Sum of the magnitudes of the terms that cancel in the rate of V_r [W]."""
    theta_tilde = v.theta_r - v.theta_r_hat
    force = np.abs(v.Y_r) @ (np.abs(v.theta_r) + np.abs(v.theta_r_hat))
    kinetic = np.abs(v.r_r) @ (np.abs(v.M_bar @ v.along_x_rd_dot) + np.abs(v.C_bar @ v.r_r) + force)
    learning = np.abs(theta_tilde / v.Gamma_r) @ np.abs(v.theta_r_hat_dot)
    return kinetic + learning + sum(falls_of_32(v)) + np.abs(v.r_r) @ np.abs(tanh(v.e_r))


@given(cases())
def test_V_r_falls_by_at_least_the_feedback_at_every_state_and_gain(case):
    """Proposition A of the audit: in contact and out of it, projection active or not."""
    v = scope(case)
    assert v.V_r_dot <= -sum(falls_of_32(v)) + 1e-10 * size_of_V_r_dot(v)


@given(cases())
def test_what_V_r_falls_by_beyond_that_is_the_work_of_the_projection(case):
    v = scope(case)
    theta_tilde, mu = v.theta_r - v.theta_r_hat, v.Gamma_r * (v.Y_r.T @ v.r_r)
    projected = theta_tilde @ ((mu - v.theta_r_hat_dot) / v.Gamma_r)
    size = size_of_V_r_dot(v)
    agree(v.V_r_dot, *(-d for d in falls_of_32(v)), projected, size, -size, rounding=1e-10)
    assert projected <= 1e-10 * size


@given(cases(Unsaturated))
def test_under_44_V_r_with_the_square_of_e_r_falls_by_the_squares(case):
    v = scope(case)
    theta_tilde, mu = v.theta_r - v.theta_r_hat, v.Gamma_r * (v.Y_r.T @ v.r_r)
    projected = theta_tilde @ ((mu - v.theta_r_hat_dot) / v.Gamma_r)
    falls = v.r_r @ (v.k3 * v.r_r), v.e_r @ v.alpha @ v.e_r
    size = size_of_V_r_dot(v) + sum(falls) + np.abs(v.r_r) @ np.abs(v.e_r)
    agree(v.V_r_dot, *(-fall for fall in falls), projected, size, -size, rounding=1e-10)


@pytest.mark.parametrize("law", [ForceLimiting, Unsaturated])
@given(e_r=vectors(2, 3.0))
def test_the_slope_of_the_potential_is_the_feedback_at_rest(law, e_r):
    made = told(cls=law)
    slope = jacobian(made.potential, e_r)
    np.testing.assert_allclose(np.ravel(slope), made.feedback(e_r, np.zeros(2)), atol=1e-12)


@given(cases())
def test_the_dissipation_is_that_of_the_feedback(case):
    v, (s, a) = scope(case), (case.s, case.a)
    found = dissipation(case.law, errors_at(case.law, s, a))
    assert found == pytest.approx(sum(falls_of_32(v)), rel=1e-9, abs=1e-12)


def test_a_law_that_states_no_potential_has_no_lyapunov_function():
    class Own(ForceLimiting):
        potential = AdaptiveContactLaw.potential

    with pytest.raises(AlightError, match="Own does not state its potential"):
        told(cls=Own).potential(np.zeros(2))


@given(cases())
def test_50_rate_of_V_before_any_inequality(case):
    """All cross terms but those of ``e_r`` cancel; this needs the tilde of erratum E4."""
    v = scope(case)
    Lambda = 1.0 if v.x_r[0] >= v.x_m else 0.0
    chi = v.m * (
        v.alpha1 * sech2(v.e_m) * (v.eta_m - v.alpha1 * tanh(v.e_m) - v.alpha2 * tanh(v.e_f))
        + v.alpha2 * sech2(v.e_f) * (v.alpha2 * tanh(v.e_m) - v.alpha3 * tanh(v.e_f))
    )
    theta_tilde, mu = v.theta_r - v.theta_r_hat, v.Gamma_r * (v.Y_r.T @ v.r_r)
    dk_tilde, dk_mu = v.k_s / v.K_I - v.theta_dk_hat, v.Gamma * (v.x_m - v.x_0) * v.eta_m
    size = size_of_V_r_dot(v)
    agree(
        v.V_dot,
        *(-d for d in falls_of_32(v)),
        2 * v.e_r @ v.r_r,
        -2 * v.e_r @ v.alpha @ v.e_r,
        -v.alpha1 * v.k2 * v.K_I * tanh(v.e_m) ** 2,
        -v.alpha3 * v.k2 * v.K_I * tanh(v.e_f) ** 2,
        -v.alpha2 * v.m * v.k1 * v.eta_m**2,
        v.eta_m * v.K_I * (v.x_rd[0] - Lambda * v.x_r[0]),
        v.eta_m * v.K_I * (Lambda * v.x_m - v.x_m),
        v.eta_m * chi,
        theta_tilde @ ((mu - v.theta_r_hat_dot) / v.Gamma_r),
        dk_tilde * v.K_I / v.Gamma * (dk_mu - v.theta_dk_hat_dot),
        *(sign * abs(v.eta_m) * v.k1 * v.k2 * v.K_I * abs(np.sinh(2 * v.e_f)) for sign in (1, -1)),
        size,
        -size,
        rounding=1e-10,
    )


@given(cases())
def test_47_and_48_V_is_positive_and_above_the_kinetic_part(case):
    v = scope(case)
    a_1 = np.linalg.eigvalsh(v.M_bar).min()
    assert v.V >= v.V_r >= a_1 / 2 * v.r_r @ v.r_r * (1 - 1e-9) >= 0


@given(cases())
def test_V_and_V_r_do_not_know_whether_there_is_contact(case):
    """Both are continuous through the switch: neither holds Lambda or F_m."""
    touching = float(case.law.model.arm.x_r(case.s.q)[0])
    free, pressed = (
        evaluate(dataclasses.replace(case, s=case.s._replace(x_m=touching - gap)))
        for gap in (-1e-9, 1e-9)
    )
    assert free["F_m"] == 0 < pressed["F_m"]
    for name in ("V", "V_r"):
        assert pressed[name] == pytest.approx(free[name], rel=1e-5)


def test_both_vanish_at_rest_on_target_with_true_parameters():
    law = told()
    plant = law.model
    held = plant.body.k_s * (TARGET.x_md - plant.body.x_0)
    tip = (TARGET.x_md + held / plant.contact.K_I, TARGET.x_rd2)
    s = PlantState(plant.arm.inverse(tip, "-"), np.zeros(2), TARGET.x_md, 0.0, 0.0)
    truth = np.array(law.theta_r_of(law.pi_of(plant)))
    a = AdaptiveState(0.0, plant.theta_dk, truth)
    assert V(plant, law, s, a) < 1e-12
    assert V_r(plant, law, s, a) < 1e-12
    off = dataclasses.replace(law, target=dataclasses.replace(TARGET, x_rd2=TARGET.x_rd2 + 0.01))
    assert V_r(plant, off, s, a) > 1e-5
