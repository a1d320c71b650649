"""The ten columns of the regressor behind (43), typed, against the Jacobian that Alight takes."""

from __future__ import annotations

import dataclasses

import numpy as np
from hypothesis import assume, given
from numpy import cosh, sinh, tanh

from alight.control import AdaptiveState
from alight.models import LinearSpring, MassSpring, Plant, PlantState
from tests.control.cases import PLANT, Case, cases, told, true_theta_r
from tests.control.closed_loop import evaluate
from tests.paper.typed import scope, sech2


def acceleration_without_the_plant(v):
    """``B - A`` and ``g`` of ``x_rd1_ddot = (B - A) x_m_ddot + g``: nothing in them is unknown."""
    Y_d, P, P_mu, P_theta = v.x_m - v.x_0, v.theta_dk_hat_dot, v.P_mu, v.P_theta
    S, sc = cosh(2 * v.e_f), sinh(v.e_f) * cosh(v.e_f)
    e_f_dot = -v.alpha3 * tanh(v.e_f) + v.alpha2 * tanh(v.e_m) - v.k1 * cosh(v.e_f) ** 2 * v.eta_m
    A = v.Gamma * Y_d**2 * P_mu + v.k1**2 * v.k2 * S * cosh(v.e_f) ** 2
    B = v.theta_dk_hat + 1 - v.k2 * sech2(v.e_m)
    e_0 = -v.alpha1 * sech2(v.e_m) * v.x_m_dot + v.alpha2 * sech2(v.e_f) * e_f_dot
    g = (
        A * e_0,
        (v.Gamma * Y_d * v.eta_m * P_mu + 2 * P) * v.x_m_dot,
        -2 * v.k2 * sech2(v.e_m) * tanh(v.e_m) * v.x_m_dot**2,
        Y_d * P_theta * P,
        -4 * v.k1 * v.k2 * sc * e_f_dot**2,
        -v.k1 * v.k2 * S * (-v.alpha3 * sech2(v.e_f) - 2 * v.k1 * sc * v.eta_m) * e_f_dot,
        v.k1 * v.k2 * S * v.alpha2 * sech2(v.e_m) * v.x_m_dot,
    )
    return B - A, sum(g), sum(abs(term) for term in g)


def inertia_of_each_parameter(case):
    """``M_j`` and ``C_j``, the shares of ``p1``, ``p2`` and ``p3`` in M and C."""
    c2, s2 = np.cos(case.s.q[1]), np.sin(case.s.q[1])
    w1, w2 = case.s.q_dot
    M = ([[1, 0], [0, 0]], [[0, 1], [1, 1]], [[2 * c2, c2], [c2, 0]])
    C = (np.zeros((2, 2)), np.zeros((2, 2)), [[-s2 * w2, -s2 * (w1 + w2)], [s2 * w1, 0]])
    return [(np.array(m, dtype=float), np.array(c, dtype=float)) for m, c in zip(M, C, strict=True)]


@given(cases())
def test_each_column_is_the_one_derived_by_hand(case):
    v = scope(case)
    slope, g, g_scale = acceleration_without_the_plant(v)
    delta, Y_d = max(v.x_r[0] - v.x_m, 0.0), v.x_m - v.x_0
    J_inv = np.linalg.inv(v.J)
    velocity = v.x_rd_dot + v.alpha @ v.e_r
    columns, scales = [], []
    for M_j, C_j in inertia_of_each_parameter(case):
        M_bar = J_inv.T @ M_j @ J_inv
        C_bar = J_inv.T @ (C_j - M_j @ J_inv @ v.J_dot) @ J_inv
        columns += [
            M_bar[:, 0] * slope * delta,
            -M_bar[:, 0] * slope * Y_d,
            M_bar @ (np.array([g, 0.0]) + v.alpha @ v.e_r_dot) + C_bar @ velocity,
        ]
        reach = np.linalg.norm(J_inv) ** 2 * np.linalg.norm(M_j)
        turning = np.linalg.norm(J_inv) ** 2 * (
            np.linalg.norm(C_j) + np.linalg.norm(M_j) * np.linalg.norm(J_inv @ v.J_dot)
        )
        moving = g_scale + np.abs(v.alpha @ v.e_r_dot).max()
        size = abs(slope) + v.k2 + 1.0
        scales += [
            reach * size * delta,
            reach * size * abs(Y_d),
            reach * moving + turning * np.abs(velocity).max(),
        ]
    columns.append(np.array([delta, 0.0]))
    scales.append(delta)
    for found, typed, scale in zip(v.Y_r.T, columns, scales, strict=True):
        np.testing.assert_allclose(found, typed, rtol=0, atol=1e-10 * scale)


@given(cases())
def test_theta_r_is_the_pattern_that_43_shows(case):
    np.testing.assert_allclose(scope(case).theta_r, true_theta_r(case.law.model), rtol=1e-14)


@given(cases())
def test_noncontact_leaves_nothing_in_the_columns_of_the_contact_stiffness(case):
    v = scope(case)
    assume(v.x_r[0] < v.x_m)
    assert not v.Y_r[:, [0, 3, 6, 9]].any()


def test_in_contact_the_ten_columns_are_independent():
    law = told()
    rng = np.random.default_rng(0)
    rows = []
    for _ in range(20):
        q = np.array([rng.uniform(0, 2), rng.uniform(-2.5, -0.5)])
        q_dot, e_f = rng.uniform(-2, 2, 2), rng.uniform(-0.5, 0.5)
        x_m = PLANT.arm.x_r(q)[0] - rng.uniform(1e-3, 5e-3)
        s = PlantState(q, q_dot, x_m, rng.uniform(-0.5, 0.5), 0.0)
        a = AdaptiveState(np.tanh(e_f), PLANT.theta_dk, np.zeros(10))
        rows.append(evaluate(Case(law, s, e_f, a))["Y_r"])
    stacked = np.vstack(rows)
    singular = np.linalg.svd(stacked / np.linalg.norm(stacked, axis=0), compute_uv=False)
    assert singular.min() > 1e-3 * singular.max()


@given(cases())
def test_the_regressor_does_not_know_what_it_multiplies(case):
    """It depends on ``theta_dk_hat`` (erratum E21), and on neither truth nor ``theta_r_hat``."""
    arm = case.law.model.arm.with_inertia([9.0, 1.0, 0.5])
    body = MassSpring(m=7.0, k_s=3.0, x_0=case.law.model.body.x_0)
    lying = dataclasses.replace(case.law, model=Plant(arm, body, LinearSpring(K_I=11.0)))
    other = case.a._replace(theta_r_hat=np.zeros(10))
    found = evaluate(Case(lying, case.s, case.e_f, other))["Y_r"]
    np.testing.assert_array_equal(found, evaluate(case)["Y_r"])
