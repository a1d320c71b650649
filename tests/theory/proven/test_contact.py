"""Proposition B: its identity, condition VTX, and the bounds in permanent contact."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Sequence
from typing import Any

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import differential_evolution

import alight
from alight.control import AdaptiveState, Estimate, ForceLimiting, Gains
from alight.models import LinearSpring, MassSpring, Plant
from alight.simulation.closed_loop import ClosedLoop, InitialState
from alight.simulation.continuous import continuous_rates, split_state
from alight.symbolic.derive import time_derivative
from alight.theory import V_m
from alight.theory.case import Case, case_of
from alight.theory.lyapunov import errors_at
from alight.theory.proven import (
    FirstContact,
    MassBounds,
    Q,
    RobotBounds,
    first_contact,
    mass_bounds,
    mass_bounds_of,
    mass_obstacle,
    nearest_vtx_of,
    robot_bounds,
    robot_bounds_of,
    schur_margin,
    vtx_margin,
)
from tests.control.cases import PLANT, TARGET, cases, gains, told, true_theta_r
from tests.lifted import Evaluate, lifted
from tests.strategies import between, log_between
from tests.theory.proven.designs import gains_at, log_uniform, random_gains
from tests.theory.test_decrease import STRONG

# The identity: V_m_dot = -z^T Q z + K_I eta_m e_r1 - the work of the projection


@functools.cache
def along() -> Evaluate:
    """``V_m`` differentiated along the closed loop, contact held, and what the identity needs."""

    def expressions(law: ForceLimiting, column: ca.SX) -> dict[str, Any]:
        rates, _ = continuous_rates(law.model, law, column, pressing=1.0)
        s, memory = split_state(law, column)
        e = errors_at(law, s, AdaptiveState(**memory))

        def value(x: ca.SX) -> ca.SX:
            at, held = split_state(law, x)
            return V_m(law.model, law, at, AdaptiveState(**held))

        mu = law.mu_dk(s.x_m, e.eta_m)
        work = (mu - e.theta_dk_hat_dot) / law.gains.Gamma
        return {
            "V_m_dot": time_derivative(value, [column], [rates], constants=law),
            "z": ca.vertcat(ca.tanh(e.e_m), e.u_f, e.eta_m),
            "e_r1": e.e_r[0],
            "leaked": (law.model.theta_dk - e.theta_dk_hat) * work,
        }

    return lifted(told(), {"x": 19}, expressions)


def pressed(case: Any) -> dict[str, Any]:
    """The identity's terms at a state, as if in contact, and the size of what cancels."""
    law, m, K_I = case.law, case.law.model.body.m, case.law.model.contact.K_I
    found = along()(law, case.column)
    z, e_r1 = found["z"], found["e_r1"][0]
    a, b = 1 - z[0] ** 2, 1 - z[1] ** 2
    terms = Q(law.gains, m, K_I, a, b) * np.outer(z, z)
    crossed = K_I * law.gains.k2 * np.abs(z[2]) * (np.abs(z[0]) + law.gains.k1 * np.abs(z[1]) / b)
    learned = K_I * abs(case.s.x_m - law.model.body.x_0) * abs(z[2]) * law.model.theta_dk
    size = np.abs(terms).sum() + K_I * abs(z[2]) * abs(e_r1) + crossed + learned
    leaked = K_I * found["leaked"][0]
    return {
        "V_m_dot": found["V_m_dot"][0],
        "falls": terms.sum(),
        "driven": K_I * z[2] * e_r1,
        "leaked": leaked,
        "size": size + abs(leaked),
        "e_r1": e_r1,
    }


@given(cases())
def test_V_m_falls_by_Q_but_for_e_r1_and_the_projection(case):
    v = pressed(case)
    rest = v["V_m_dot"] + v["falls"] - v["driven"] - v["leaked"]
    assert abs(rest) <= 1e-9 * v["size"]


@given(cases())
def test_the_projection_of_theta_dk_hat_only_helps(case):
    v = pressed(case)
    assert v["leaked"] <= 1e-12 * v["size"]


@given(cases(), log_between(1e-3, 10.0))
def test_under_VTX_V_m_rises_no_faster_than_the_square_of_e_r1(case, softer):
    g = dataclasses.replace(case.law.gains, alpha1=0.1 * softer, alpha3=1.0, k1=5.0, alpha2=5.0)
    law = dataclasses.replace(case.law, gains=g)
    m, K_I = law.model.body.m, law.model.contact.K_I
    margin = vtx_margin(g, m, K_I)
    v = pressed(dataclasses.replace(case, law=law))
    if margin > 0:
        allowed = K_I**2 * v["e_r1"] ** 2 / (4 * m * margin)
        assert v["V_m_dot"] <= allowed + 1e-9 * (v["size"] + allowed)


# VTX decides


VERTICES = [(1.0, 0.0), (0.0, 1.0), (1.0, 1.0)]


def audits_margins(g: Gains, m: float, K_I: float) -> list[float]:
    """VTX as it was first stated, at three vertices, typed."""
    return [
        g.alpha2 * g.k1
        - g.alpha1 * a
        - m
        / (4 * g.k2 * K_I)
        * (
            (g.alpha1**2 * a - g.alpha2**2 * b) ** 2 / g.alpha1
            + g.alpha2**2 * (g.alpha1 * a + g.alpha3 * b) ** 2 / g.alpha3
        )
        for a, b in VERTICES
    ]


@given(gains(), log_between(0.1, 20.0), log_between(1e3, 1e6))
def test_the_margin_is_the_least_of_the_three_of_the_condition_as_first_stated(g, m, K_I):
    stated = np.array(audits_margins(g, m, K_I))
    size = 2 * g.alpha2 * g.k1 + np.abs(stated).max()
    found = [schur_margin(g, m, K_I, a, b) for a, b in VERTICES]
    np.testing.assert_allclose(found, stated, rtol=0, atol=1e-12 * size)
    assert vtx_margin(g, m, K_I) == pytest.approx(stated.min(), rel=0, abs=1e-12 * size)


@given(gains(), log_between(0.1, 20.0), log_between(1e3, 1e6))
def test_the_margin_is_that_of_the_single_inequality(g, m, K_I):
    """As the condition states it."""
    a1, a2, a3 = g.alpha1, g.alpha2, g.alpha3
    coupled = (a1 * a3 + a2**2) * (a1**3 + a2**2 * a3) / (a1 * a3)
    right = a1 + m / (4 * g.k2 * K_I) * coupled
    left = a2 * g.k1
    assert vtx_margin(g, m, K_I) == pytest.approx(left - right, rel=0, abs=1e-12 * (left + right))


@given(gains(), log_between(0.1, 20.0), log_between(1e3, 1e6))
def test_rest_is_the_worst_vertex_by_two_positive_differences(g, m, K_I):
    a1, a2, a3, c = g.alpha1, g.alpha2, g.alpha3, m / (4 * g.k2 * K_I)
    at_10, at_01, at_11 = (schur_margin(g, m, K_I, a, b) for a, b in VERTICES)
    below_10 = c * a2**2 * (a2**2 / a1 + a3)
    below_01 = a1 + c * a1**2 * (a1 + a2**2 / a3)
    assert below_10 > 0 and below_01 > 0
    size = a2 * g.k1 + abs(at_10) + abs(at_01) + abs(at_11)
    assert at_10 - at_11 == pytest.approx(below_10, rel=0, abs=1e-12 * size)
    assert at_01 - at_11 == pytest.approx(below_01, rel=0, abs=1e-12 * size)
    assert schur_margin(g, m, K_I, 0.0, 0.0) == pytest.approx(a2 * g.k1)


def test_Q_is_positive_definite_for_all_states_just_where_VTX_holds():
    rng = np.random.default_rng(4)
    g, m = random_gains(rng, 4000), log_uniform(rng, 0.3, 20.0, 4000)
    K_I = log_uniform(rng, 5e3, 5e5, 4000)
    margins = vtx_margin(g, m, K_I)
    assert (margins > 0).sum() > 500 < (margins < 0).sum()
    for i in range(len(m)):
        own = gains_at(g, i)
        inside = [tuple(ab) for ab in rng.uniform(0.0, 1.0, (6, 2))] if margins[i] > 0 else []
        tried = [Q(own, m[i], K_I[i], a, b) for a, b in (*inside, *VERTICES)]
        scaled = [q / np.sqrt(np.outer(np.abs(np.diag(q)), np.abs(np.diag(q)))) for q in tried]
        least = min(np.linalg.eigvalsh(q)[0] for q in scaled)
        assert (least > 0) == (margins[i] > 0), (own, m[i], K_I[i])


@given(gains(), log_between(0.1, 20.0), log_between(1e3, 1e6), *[between(0.0, 1.0)] * 2)
def test_the_margin_is_the_least_share_of_eta_m_over_all_states(g, m, K_I, a, b):
    """``z^T Q z >= m margin eta_m^2``: what is left of eta_m when the others are at their worst."""
    q = Q(g, m, K_I, a, b)
    worst = np.append(-np.linalg.solve(q[:2, :2], q[:2, 2]), 1.0)
    size = np.abs(q * np.outer(worst, worst)).sum()
    assert worst @ q @ worst >= m * vtx_margin(g, m, K_I) - 1e-12 * size
    assert worst @ q @ worst == pytest.approx(
        m * schur_margin(g, m, K_I, a, b), rel=0, abs=1e-12 * size
    )


def test_26_and_37_imply_VTX():
    """They ask for more: with zeta_1 by its corners, for every mass in its interval."""
    rng = np.random.default_rng(5)
    count = 20_000
    alpha1, alpha2, alpha3 = log_uniform(rng, 1e-2, 1e2, (3, count))
    k2, K_l = log_uniform(rng, 1e-3, 10.0, count), log_uniform(rng, 1e-2, 1e5, count)
    m_l = log_uniform(rng, 1e-2, 1e3, count)
    m_u = m_l * rng.uniform(1.0, 3.0, count)
    k_n1 = rng.uniform(1.0, 2.0, count) / (
        4 * alpha2 * np.minimum.reduce([alpha1 * k2 * K_l, alpha3 * k2 * K_l, alpha2])
    )
    chi = [
        alpha1**2 * a**2
        + (alpha2**2 * b - alpha1**2 * a) ** 2
        + (alpha1 * alpha2 * a + alpha2 * alpha3 * b) ** 2
        for a, b in VERTICES
    ]
    zeta_1 = m_u * np.sqrt(np.max(chi, axis=0))
    k1 = (3 + k_n1 * zeta_1**2) / m_l
    g = Gains(1.0, 1.0, (1.0, 1.0), 1.0, 1.0, 1.0, (1.0, 1.0), 1.0)
    named = dict(k1=k1, k2=k2, alpha1=alpha1, alpha2=alpha2, alpha3=alpha3)
    g = alight.symbolic.parameters.rebind(g, **named)
    for m in (m_l, m_u):
        assert (vtx_margin(g, m, K_l) > 0).all()


# Bounds in permanent contact


@functools.cache
def certified() -> Case:
    """Experiment 1 with gains near (42) that satisfy VTX with some margin."""
    case = case_of(alight.load_scenario("experiment-1"))
    near = dataclasses.replace(nearest_vtx_of(case), alpha1=5.0, alpha3=1.0)
    return dataclasses.replace(case, law=dataclasses.replace(case.law, gains=near))


@functools.cache
def arm_known(k2: float, alpha1: float) -> Case:
    """The same with other gains and an arm that is all but known: the force has a bound."""
    case = certified()
    truth = np.asarray(case.law.theta_r_of(case.law.pi_of(case.plant)), dtype=float)
    box = Estimate(tuple(truth), tuple(truth * (1 - 1e-9)), tuple(truth * (1 + 1e-9)))
    own = dataclasses.replace(case.law.gains, k2=k2, alpha1=alpha1)
    law = dataclasses.replace(case.law, gains=own, theta_r=box)
    return dataclasses.replace(case, law=law, a=case.a._replace(theta_r_hat=truth))


CASES = {
    "boxes": certified,
    "arm known": functools.partial(arm_known, 2.0, 2.0),
    "arm known, quick filter": functools.partial(arm_known, 5.0, 1.0),
}


@functools.cache
def over_the_assumptions(name: str) -> tuple[RobotBounds, FirstContact, MassBounds]:
    case = CASES[name]()
    found = mass_bounds(case)
    assert found is not None
    return robot_bounds(case), first_contact(case), found


def bounds_at(name: str, shares: Sequence[float]) -> MassBounds:
    """With a plant inside of the assumptions: shares of ``m, K_I, theta_dk``, and of ``u_inf``."""
    case = CASES[name]()
    b, box = case.bounds, case.law.theta_dk
    robot, touch, _ = over_the_assumptions(name)
    ends = np.array([(b.m_l, b.m_u), b.zeta_K, (box.lower, box.upper), (0.0, touch.u_inf)])
    m, K_I, theta_dk, u_f = ends[:, 0] + np.array(shares) * (ends[:, 1] - ends[:, 0])
    body = MassSpring(m, theta_dk * K_I, case.law.model.body.x_0)
    plant = Plant(case.plant.arm, body, LinearSpring(K_I=K_I))
    found = mass_bounds_of(plant, case.law, case.s, case.a._replace(u_f=u_f), robot)
    assert found is not None
    return found


@pytest.mark.parametrize("name", CASES)
@given(shares=st.tuples(*[st.one_of(st.sampled_from([0.0, 1.0]), between(0.0, 1.0))] * 4))
def test_the_bounds_hold_for_every_plant_within_the_assumptions(name, shares):
    _, _, found = over_the_assumptions(name)
    one = bounds_at(name, shares)
    assert one.margin >= found.margin * (1 - 1e-12)
    for bound in ("V_m", "e_m", "e_f", "eta_m"):
        assert getattr(one, bound) <= getattr(found, bound) * (1 + 1e-12), bound
    if found.F_m is not None:
        assert one.F_m is not None and one.F_m <= found.F_m * (1 + 1e-12)


@pytest.mark.parametrize("name", ["arm known", "arm known, quick filter"])
def test_a_search_finds_no_plant_whose_bound_of_the_force_is_larger(name):
    """Of this bound it is not proven that its worst stands at a corner."""
    _, _, found = over_the_assumptions(name)
    best = differential_evolution(
        lambda shares: -np.log(bounds_at(name, shares).F_m),
        [(0.0, 1.0)] * 4,
        maxiter=12,
        popsize=8,
        seed=np.random.default_rng(0),
    )
    assert np.log(found.F_m) - 1e-3 < -best.fun <= np.log(found.F_m) + 1e-12


def test_u_f_at_its_limit_before_contact_can_be_worse_than_at_its_start():
    name = "arm known, quick filter"
    _, touch, found = over_the_assumptions(name)
    assert touch.u_inf > 0 == CASES[name]().a.u_f
    at_start = [bounds_at(name, (*corner, 0.0)) for corner in np.ndindex(2, 2, 2)]
    assert max(bounds.V_m for bounds in at_start) < found.V_m * (1 - 1e-6)
    assert max(bounds.F_m for bounds in at_start) < found.F_m * (1 - 1e-6)


def test_without_VTX_there_is_no_bound_and_it_says_why():
    case = case_of(alight.load_scenario("experiment-1"))
    assert mass_bounds(case) is None
    assert "VTX" in mass_obstacle(case)
    known = robot_bounds_of(case.plant, case.law, case.s, case.a)
    assert mass_bounds_of(case.plant, case.law, case.s, case.a, known) is None
    moving = dataclasses.replace(certified(), s=case.s._replace(x_m_dot=0.1))
    assert "rest" in mass_obstacle(moving)


CALM = Gains(
    k1=2.0,
    k2=0.3,
    k3=(40.0, 40.0),
    alpha1=5.0,
    alpha2=10.0,
    alpha3=2.0,
    alpha=(20.0, 20.0),
    Gamma=0.5,
)


@pytest.mark.parametrize(("compression", "off"), [(0.02, 1e-4), (0.028, -5e-4), (0.03, 1e-3)])
def test_they_hold_along_a_run_in_permanent_contact(compression, off):
    body = MassSpring(2.0, 600.0, TARGET.x_md - 0.03)
    plant = dataclasses.replace(PLANT, body=body, contact=LinearSpring(K_I=1e4))
    theta_r = true_theta_r(plant)
    known = Estimate(tuple(theta_r), tuple(theta_r / 2), tuple(2 * theta_r))
    dk = Estimate(plant.theta_dk, plant.theta_dk / 2, 2 * plant.theta_dk)
    law = told(plant, CALM, theta_r=known, theta_dk=dk)
    x_m = body.x_0 + compression
    tip = x_m + body.k_s * compression / plant.contact.K_I + off
    q = plant.arm.inverse((tip, TARGET.x_rd2 + off), "-")
    start = InitialState(q=(float(q[0]), float(q[1])), x_m=x_m)
    run = alight.reference(ClosedLoop(plant, STRONG, law), start, np.linspace(0, 1.0, 501))
    seen = run.recording
    assert (seen["gap"] >= 0).all()
    s = alight.models.PlantState(q, np.zeros(2), x_m, 0.0, 0.0)
    a = AdaptiveState(**law.initial_state())
    bounds = mass_bounds_of(plant, law, s, a, robot_bounds_of(plant, law, s, a))
    assert np.abs(seen["e_m"]).max() <= bounds.e_m
    assert np.abs(seen["u_f"]).max() <= np.tanh(bounds.e_f)
    assert np.abs(seen["eta_m"]).max() <= bounds.eta_m
    assert seen["F_m"].max() <= bounds.F_m
    parts = ("q", "q_dot", "x_m", "x_m_dot", "z", "u_f", "theta_dk_hat", "theta_r_hat")
    states = np.hstack([seen[name].reshape(len(seen.t), -1) for name in parts])
    energies = []
    for column in states[::50]:
        at, memory = split_state(law, column)
        energies.append(float(V_m(plant, law, at, AdaptiveState(**memory))))
    assert max(energies) <= bounds.V_m
    assert energies[-1] < 0.2 * bounds.V_m


@given(st.sampled_from([1e-3, 0.1, 1.0]), between(0.0, 1.0))
def test_the_contact_force_of_every_bounded_state_is_below_its_bound(size, share):
    law = certified().law
    x_md, K_I = law.target.x_md, 1e5
    e_m = e_f = size
    bound = alight.theory.proven.contact.largest_force(law, K_I, e_m, e_f, 0.01)
    for x_m in x_md + np.array([-e_m, share * e_m, e_m]):
        for u_f in np.tanh([-e_f, share * e_f, e_f]):
            for theta_dk in law.theta_dk.widened:
                gap = law.x_rd1(x_m, u_f, theta_dk) - x_m + 0.01
                assert K_I * gap <= bound * (1 + 1e-12)
