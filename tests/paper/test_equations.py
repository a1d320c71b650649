"""The equations of the paper, typed as printed with their errata, against what Alight derives.

Each test types one equation in the paper's own symbols; the name of the test says where it stands.
States, gains and plants are random; the loop is closed with (32) unless a test says otherwise.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from numpy import cosh, sinh, tanh

from alight.control import ForceLimiting, Unsaturated
from tests.control.cases import Case, cases, changed
from tests.control.closed_loop import evaluate
from tests.paper.typed import agree, projected, scope, sech2

RANDOM = given(cases())


def e_f_dot(v):  # (18)
    return -v.alpha3 * tanh(v.e_f) + v.alpha2 * tanh(v.e_m) - v.k1 * cosh(v.e_f) ** 2 * v.eta_m


def chi(v):  # (22)
    return (
        v.alpha1 * v.m * sech2(v.e_m) * (v.eta_m - v.alpha1 * tanh(v.e_m))
        - v.alpha1 * v.alpha2 * v.m * sech2(v.e_m) * tanh(v.e_f)
        + v.alpha2 * v.m * sech2(v.e_f) * (-v.alpha3 * tanh(v.e_f))
        + v.alpha2 * v.m * sech2(v.e_f) * (v.alpha2 * tanh(v.e_m))
    )


def Y_d(v):  # (19)
    return v.x_m - v.x_0


def Lambda(v):  # (8)
    return 1.0 if v.x_r[0] >= v.x_m else 0.0


# Error system, (16)-(22)


@RANDOM
def test_16_regulation_errors(case):
    v = scope(case)
    agree(v.e_r, v.x_rd, -v.x_r)
    agree(v.e_m, v.x_md, -v.x_m)
    agree(v.along_e_m, -v.x_m_dot)
    agree(v.along_e_r, v.e_r_dot)


@RANDOM
def test_17_filtered_errors(case):
    v = scope(case)
    agree(v.eta_m, v.along_e_m, v.alpha1 * tanh(v.e_m), v.alpha2 * tanh(v.e_f))
    agree(v.r_r, v.along_e_r, v.alpha @ v.e_r)


@RANDOM
def test_18_filter_in_the_form_of_its_tanh(case):
    v = scope(case)
    terms = (-v.alpha3 * tanh(v.e_f), v.alpha2 * tanh(v.e_m), -v.k1 * cosh(v.e_f) ** 2 * v.eta_m)
    assert sum(terms) == e_f_dot(v)
    agree(v.u_f_dot, *(sech2(v.e_f) * term for term in terms))


@RANDOM
def test_19_open_loop_of_the_mass(case):
    v = scope(case)
    agree(
        v.m * v.along_eta_m,
        Y_d(v) * v.k_s,
        -v.K_I * Lambda(v) * (v.x_r[0] - v.x_m),
        v.alpha2 * v.m * sech2(v.e_f) * e_f_dot(v),
        v.alpha1 * v.m * sech2(v.e_m) * v.along_e_m,
        v.alpha2 * v.m * v.k1 * v.eta_m,  # cancelled within e_f_dot: it sets the scale
        -v.alpha2 * v.m * v.k1 * v.eta_m,
    )


@RANDOM
def test_20_spring_force_over_the_contact_stiffness(case):
    v = scope(case)
    agree(Y_d(v) * v.k_s, v.K_I * Y_d(v) * case.law.model.theta_dk)


@RANDOM
def test_21_and_22_the_mass_with_chi(case):
    v = scope(case)
    agree(
        v.m * v.along_eta_m,
        Y_d(v) * v.k_s,
        v.K_I * (v.x_rd[0] - Lambda(v) * v.x_r[0]),
        v.K_I * Lambda(v) * v.x_m,
        -v.K_I * v.x_rd[0],
        chi(v),
        -v.alpha2 * v.m * v.k1 * v.eta_m,
    )


# Desired trajectory, (25)-(29)


@RANDOM
def test_25_desired_trajectory(case):
    v = scope(case)
    agree(
        v.x_rd[0],
        Y_d(v) * v.theta_dk_hat,
        v.x_m,
        v.k2 * tanh(v.e_m),
        -v.k1 * v.k2 * cosh(v.e_f) ** 2 * tanh(v.e_f),
    )
    assert v.x_rd[1] == v.x_rd2
    assert v.x_rd_dot[1] == 0


@RANDOM
def test_27_adaptation_of_theta_dk(case):
    v = scope(case)
    mu = v.Gamma * Y_d(v) * v.eta_m
    P = projected(case.law.theta_dk, mu, v.theta_dk_hat)
    agree(v.theta_dk_hat_dot, P, mu, -mu)


@RANDOM
def test_29_closed_loop_of_the_mass(case):
    v = scope(case)
    theta_tilde = v.k_s / v.K_I - v.theta_dk_hat
    agree(
        v.m * v.along_eta_m,
        v.K_I * (v.x_rd[0] - Lambda(v) * v.x_r[0]),
        v.K_I * (Lambda(v) * v.x_m - v.x_m),
        v.K_I * v.k1 * v.k2 * cosh(v.e_f) ** 2 * tanh(v.e_f),
        v.K_I * Y_d(v) * theta_tilde,
        -v.K_I * v.k2 * tanh(v.e_m),
        chi(v),
        -v.alpha2 * v.m * v.k1 * v.eta_m,
    )


# Robot error system and laws, (30)-(36) and (44), also where gravity acts


def in_both_planes(test):
    horizontal = given(cases(plane="horizontal"))(test)
    vertical = given(cases(plane="vertical"))(test)
    runs = {"horizontal": horizontal, "vertical": vertical}

    @pytest.mark.parametrize("plane", list(runs))
    def both(plane):
        runs[plane]()

    both.__name__ = test.__name__
    return both


@in_both_planes
def test_30_open_loop_of_the_tip(case):
    v = scope(case)
    agree(
        v.M_bar @ v.along_r_r,
        v.Y_r @ v.theta_r,
        -v.C_bar @ v.r_r,
        -v.F,
        v.M_bar @ v.along_x_rd_dot,  # cancels on both sides: it sets the scale
        -v.M_bar @ v.along_x_rd_dot,
    )


@in_both_planes
def test_31_required_force_with_the_order_of_erratum_E1(case):
    v = scope(case)
    impact = np.array([v.K_I * Lambda(v) * (v.x_r[0] - v.x_m), 0.0])
    terms = (
        v.M_bar @ v.along_x_rd_dot,
        v.M_bar @ v.alpha @ v.e_r_dot,
        v.h_bar,
        v.C_bar @ v.x_rd_dot,
        v.C_bar @ v.alpha @ v.x_rd,
        impact,
        -v.C_bar @ v.alpha @ v.x_r,
    )
    agree(v.W, *terms)
    agree(v.Y_r @ v.theta_r, *terms)


def printed_31(v):  # with the scalar alpha of the text, as a matrix
    impact = np.array([v.K_I * Lambda(v) * (v.x_r[0] - v.x_m), 0.0])
    return (
        v.M_bar @ v.along_x_rd_dot,
        v.alpha @ v.M_bar @ v.e_r_dot,
        v.h_bar,
        v.C_bar @ v.x_rd_dot,
        v.alpha @ v.C_bar @ v.x_rd,
        impact,
        -v.alpha @ v.C_bar @ v.x_r,
    )


@RANDOM
def test_31_as_printed_holds_for_a_scalar_alpha(case):
    alpha = case.law.gains.alpha[0]
    scalar = dataclasses.replace(case, law=changed(case.law, alpha=(alpha, alpha)))
    v = scope(scalar)
    agree(v.W, *printed_31(v))


@RANDOM
def test_31_as_printed_misses_by_the_commutator_for_a_diagonal_alpha(case):
    """Erratum E1; `test_vectors` shows how large the miss is with (42)."""
    v = scope(dataclasses.replace(case, law=changed(case.law, alpha=(50.0, 4.5))))

    def commutator(matrix):
        return v.alpha @ matrix - matrix @ v.alpha

    terms = printed_31(v)
    miss = sum(terms) - v.W
    scale = (*terms, *(-term for term in terms))
    agree(miss, commutator(v.M_bar) @ v.e_r_dot, commutator(v.C_bar) @ v.e_r, *scale)


@RANDOM
def test_32_force_limiting_law(case):
    v = scope(case)
    agree(v.F, v.Y_r @ v.theta_r_hat, tanh(v.e_r), v.k3 * tanh(v.r_r))
    agree(v.tau, v.J.T @ v.F)


@RANDOM
def test_33_adaptation_of_theta_r(case):
    v = scope(case)
    mu = v.Gamma_r * (v.Y_r.T @ v.r_r)
    P = projected(case.law.theta_r, mu, v.theta_r_hat)
    scale = v.Gamma_r * (np.abs(v.Y_r.T) @ np.abs(v.r_r)) + np.abs(P)
    assert (np.abs(v.theta_r_hat_dot - P) <= 1e-10 * scale).all()


@in_both_planes
def test_35_and_36_closed_loop_of_the_tip(case):
    v = scope(case)
    theta_tilde = v.theta_r - v.theta_r_hat
    agree(
        v.M_bar @ v.along_r_r,
        v.Y_r @ theta_tilde,
        -v.C_bar @ v.r_r,
        -tanh(v.e_r),
        -v.k3 * tanh(v.r_r),
        v.M_bar @ v.along_x_rd_dot,
        -v.M_bar @ v.along_x_rd_dot,
    )


@given(cases(Unsaturated))
def test_44_law_without_saturated_feedback(case):
    v = scope(case)
    agree(v.F, v.Y_r @ v.theta_r_hat, v.e_r, v.k3 * v.r_r)
    agree(v.tau, v.J.T @ v.F)


# Rates of the desired trajectory, Appendix A


@RANDOM
def test_45_rate_of_the_desired_trajectory(case):
    v = scope(case)
    P = projected(case.law.theta_dk, v.Gamma * Y_d(v) * v.eta_m, v.theta_dk_hat)
    S = sinh(v.e_f) ** 2 + cosh(v.e_f) ** 2
    terms = (
        Y_d(v) * P,
        (v.theta_dk_hat + 1 - v.k2 * sech2(v.e_m)) * v.x_m_dot,
        v.k1 * v.k2 * S * v.alpha3 * tanh(v.e_f),
        -v.k1 * v.k2 * S * v.alpha2 * tanh(v.e_m),
        v.k1 * v.k2 * S * v.k1 * cosh(v.e_f) ** 2 * v.eta_m,
    )
    agree(v.x_rd_dot[0], *terms)
    agree(v.along_x_rd[0], *terms)


def equation_46(v):
    """Terms of (46) as printed; ``P_mu`` is the slope of the projection in its first argument."""
    Y, P = Y_d(v), v.theta_dk_hat_dot
    S = sinh(v.e_f) ** 2 + cosh(v.e_f) ** 2
    slope = -v.alpha3 * sech2(v.e_f) - 2 * v.k1 * cosh(v.e_f) * sinh(v.e_f) * v.eta_m
    dP_deta, dP_dx_m = v.Gamma * Y * v.P_mu, v.Gamma * v.eta_m * v.P_mu
    return (
        Y * dP_deta * v.along_eta_m,
        (Y * dP_dx_m + 2 * P) * v.x_m_dot,
        -2 * v.k2 * cosh(v.e_m) ** -3.0 * sinh(v.e_m) * v.x_m_dot**2,
        (v.theta_dk_hat + 1 - v.k2 * sech2(v.e_m)) * v.x_m_ddot,
        -4 * v.k1 * v.k2 * sinh(v.e_f) * cosh(v.e_f) * e_f_dot(v) ** 2,
        -v.k1 * v.k2 * S * slope * e_f_dot(v),
        v.k1 * v.k2 * S * -v.alpha2 * sech2(v.e_m) * v.along_e_m,
        v.k1 * v.k2 * S * v.k1 * cosh(v.e_f) ** 2 * v.along_eta_m,
    )


@RANDOM
def test_46_acceleration_with_the_term_of_erratum_E2(case):
    v = scope(case)
    terms = (*equation_46(v), Y_d(v) * v.P_theta * v.theta_dk_hat_dot)
    agree(v.x_rd1_ddot, *terms, rounding=1e-10)
    agree(v.along_x_rd_dot[0], *terms, rounding=1e-10)


@RANDOM
def test_46_as_printed_holds_while_the_projection_rests(case):
    box = case.law.theta_dk
    middle = float(np.clip(case.a.theta_dk_hat, box.lower, box.upper))
    inside = Case(case.law, case.s, case.e_f, case.a._replace(theta_dk_hat=middle))
    v = scope(inside)
    agree(v.x_rd1_ddot, *equation_46(v), rounding=1e-10)


@RANDOM
def test_46_needs_no_acceleration(case):
    """With (6), (7), (18) and (19) put in, (46) is affine in K_I/m and k_s/m, as (31) needs."""
    law, s, a = case.law, case.s, case.a

    def acceleration(x_m_ddot: float) -> float:
        return law.x_rd1_ddot(s.x_m, s.x_m_dot, a.u_f, a.theta_dk_hat, x_m_ddot)

    at_rest, one, ten = acceleration(0.0), acceleration(1.0), acceleration(10.0)
    agree(ten - at_rest, 10 * (one - at_rest), at_rest, -at_rest, rounding=1e-10)
    v = evaluate(case)
    agree(v["x_rd1_ddot"], at_rest, v["x_m_ddot"] * (one - at_rest), rounding=1e-10)


# (47)


@given(cases(ForceLimiting))
def test_47_lyapunov_function_with_tilde(case):
    v = scope(case)
    theta_tilde, dk_tilde = v.theta_r - v.theta_r_hat, v.k_s / v.K_I - v.theta_dk_hat
    robot = (
        v.r_r @ v.M_bar @ v.r_r / 2,
        theta_tilde @ (theta_tilde / v.Gamma_r) / 2,
        np.log(cosh(v.e_r[0])) + np.log(cosh(v.e_r[1])),
    )
    mass = (
        dk_tilde**2 * v.K_I / v.Gamma / 2,
        v.k2 * v.K_I * (np.log(cosh(v.e_m)) + np.log(cosh(v.e_f))),
        v.e_r @ v.e_r,
        v.m * v.eta_m**2 / 2,
    )
    agree(v.V, *robot, *mass)
    agree(v.V_r, *robot)
