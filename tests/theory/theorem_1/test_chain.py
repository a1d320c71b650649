"""The chain of bounds (23), (48), (53), (55) and (71) at random states, and where it breaks."""

from __future__ import annotations

import dataclasses
import functools

import casadi as ca
import numpy as np
import pytest

from alight.control import AdaptiveState, Estimate, Gains
from alight.models import LinearSpring, MassSpring, TwoLinkArm
from alight.scenarios.assumptions import Assumptions
from alight.simulation.continuous import continuous_rates, split_state
from alight.symbolic.derive import time_derivative
from alight.symbolic.ops import tanh
from alight.theory import V
from alight.theory.inertia import inertia_bounds
from alight.theory.lyapunov import errors_at
from alight.theory.theorem_1 import Corrected, Design, Printed, evaluate, zeta_1
from tests.control.cases import PLANT, TARGET, told, true_theta_r
from tests.lifted import lifted
from tests.theory.theorem_1.designs import log_uniform, random_pair

STATES = 400
ARM = TwoLinkArm(l1=2.0, l2=2.0, p1=8.0, p2=2.0, p3=2.0)
"""Long enough for the errors at which the bounds bite."""
MODEL = dataclasses.replace(PLANT, arm=ARM)
A1 = inertia_bounds(ARM, np.array([8.0, 2.0, 2.0]), np.array([8.0, 2.0, 2.0]), 1e-3).a1


@functools.cache
def seen_at():
    """``V``, its rate by differentiation, ``chi`` and what the bounds are made of."""

    def expressions(law, x):
        rates, _ = continuous_rates(law.model, law, x)

        def value(column):
            s, memory = split_state(law, column)
            return V(law.model, law, s, AdaptiveState(**memory))

        s, memory = split_state(law, x)
        e = errors_at(law, s, AdaptiveState(**memory))
        x_m_dot, u_f_dot, body, g = s.x_m_dot, e.u_f_dot, law.model.body, law.gains
        touch = law.model.touch(s)
        x_m_ddot = body.acceleration(s.x_m, x_m_dot, touch.F_m)
        eta_m_dot = time_derivative(
            lambda *filtered: law.filter_rates(*filtered)[0],
            [s.x_m, x_m_dot, e.u_f, e.theta_dk_hat],
            [x_m_dot, x_m_ddot, u_f_dot, e.theta_dk_hat_dot],
            constants=law,
        )
        left = body.m * (eta_m_dot + g.alpha2 * g.k1 * e.eta_m)  # (21) for chi
        return {
            "V": value(x),
            "V_dot": time_derivative(value, [x], [rates], constants=law),
            "chi": left - body.k_s * body.Y_d(s.x_m) + touch.F_m,
            "z": ca.vertcat(e.eta_m, tanh(e.e_m), e.u_f),
            "e_r": e.e_r,
            "r_r": e.r_r,
            "gap": e.gap,
        }

    return lifted(told(MODEL), {"x": 19}, expressions)


def random_law(rng):
    """Gains that satisfy (26), (37), the first of (38); k1 half of the time at its border."""
    m, K_I = log_uniform(rng, 0.5, 20.0), log_uniform(rng, 1.0, 300.0)
    bounds = Assumptions(0.9 * m, 1.1 * m, (0.9 * K_I, 1.1 * K_I), (1.0, 1e4), -4.0, 1.0, 0.05)
    alpha2, alpha1, alpha3 = (log_uniform(rng, 0.5, 20.0) for _ in range(3))
    k2 = log_uniform(rng, 0.05, 5.0)
    floor = bounds.zeta_K[1] ** 2 / (4 * alpha2)
    gains = Gains(
        k1=1.0,
        k2=k2,
        k3=random_pair(rng, 1.0, 300.0),
        alpha1=alpha1,
        alpha2=alpha2,
        alpha3=alpha3,
        alpha=random_pair(rng, 1.001 * floor, 10.0 * floor),
        Gamma=log_uniform(rng, 0.01, 10.0),
    )
    slowest = min(alpha1 * k2 * 0.9 * K_I, alpha3 * k2 * 0.9 * K_I, alpha2)
    k_n1 = log_uniform(rng, 1.01, 10.0) / (4 * alpha2 * slowest)
    k1 = (3 + k_n1 * zeta_1(gains, bounds.m_u) ** 2) / bounds.m_l
    plant = dataclasses.replace(
        MODEL,
        body=MassSpring(m, log_uniform(rng, 1.0, 1e4), x_0=0.206),
        contact=LinearSpring(K_I=K_I),
    )
    return told(plant, dataclasses.replace(gains, k1=float(k1))), bounds


def random_state(rng, law):
    """Near or far, in contact or not, the estimates anywhere in their boxes."""
    size = 10.0 ** rng.uniform(-3, 0)
    q = np.array([rng.uniform(-np.pi, np.pi), rng.choice([-1, 1]) * rng.uniform(0.3, 2.8)])
    x_r1 = float(law.model.arm.x_r(q)[0])
    lead = float(rng.choice([0.0, 1.0])) * size * rng.uniform(0.0, 0.1)
    x_m = x_r1 - lead if rng.uniform() < 0.5 else x_r1 + size * rng.uniform(0.0, 2.0)
    hats = rng.uniform(law.theta_r.lower, law.theta_r.upper)
    u_f = np.tanh(size * rng.normal())
    dk = rng.uniform(law.theta_dk.lower, law.theta_dk.upper)
    rates = size * rng.normal(size=3)
    return np.array([*q, *rates[:2], x_m, rates[2], 0.0, u_f, dk, *hats])


def design(law, bounds, x_m, x_r1):
    """The design of a law, with the bounds of (4) as tight as a state allows."""
    bounds = dataclasses.replace(
        bounds, zeta_xr=min(float(x_r1), 0.0) - 1e-9, zeta_xm=max(float(x_m), 0.0) + 1e-9
    )
    theta_r = true_theta_r(law.model)
    return Design(
        gains=law.gains,
        bounds=bounds,
        inertia=dataclasses.replace(inertia(), a1=A1),
        x_md=TARGET.x_md,
        x_0=0.206,
        theta_dk=law.theta_dk,
        theta_r=Estimate(tuple(theta_r), tuple(theta_r / 2), tuple(2 * theta_r)),
        Gamma_r=law.Gamma_r,
        z_bar=1.0,
        V_0=1.0,
    )


@functools.cache
def inertia():
    return inertia_bounds(ARM, np.array([8.0, 2.0, 2.0]), np.array([8.0, 2.0, 2.0]), 0.05)


class Sample:
    """One law, one state, and what the bounds need of them."""

    def __init__(self, rng):
        self.law, bounds = random_law(rng)
        x = random_state(rng, self.law)
        found = seen_at()(self.law, x)
        (self.V,), (self.V_dot,), (self.chi,), (self.gap,) = (
            found[name] for name in ("V", "V_dot", "chi", "gap")
        )
        self.z, self.e_r, self.r_r = found["z"], found["e_r"], found["r_r"]
        self.d = design(self.law, bounds, x[4], x[4] + self.gap)
        self.beta = evaluate(self.d, Corrected()).constant("beta").value

    def epsilon_x(self, f):
        return evaluate(self.d, f).constant("eps_x").value

    @property
    def common(self):
        """``-beta |z|^2``."""
        return -self.beta * self.z @ self.z

    def by_axis(self, alpha, k3):
        """The terms of (53) in ``e_r`` and ``r_r``, axis by axis."""
        e, r = np.array(self.e_r), np.array(self.r_r)
        quotient = np.divide(r, np.tanh(r), out=np.ones(2), where=r != 0)
        return -alpha @ np.tanh(e) ** 2 - (r * np.tanh(r)) @ (k3 - quotient / alpha)

    def by_norm(self):
        """The same as (53) prints it, with the least of each diagonal."""
        g = self.law.gains
        alpha, k3 = min(g.alpha), min(g.k3)
        e, r = np.linalg.norm(self.e_r), np.linalg.norm(self.r_r)
        return -alpha * np.tanh(e) ** 2 - k3 * np.tanh(r) ** 2 + r**2 / alpha


@functools.cache
def samples():
    rng = np.random.default_rng(0)
    return [Sample(rng) for _ in range(STATES)]


def respected(bound, s):
    return s.V_dot <= bound + 1e-9 * (abs(s.V_dot) + abs(bound))


def test_the_states_are_in_contact_and_out_of_it():
    touching = sum(s.gap >= 0 for s in samples())
    assert 0.2 * STATES < touching < 0.8 * STATES
    for s in samples():
        reading = evaluate(s.d, Corrected())
        assert all(reading.condition(n).holds for n in ("(26)", "(37)", "(38), first"))


def test_23_zeta_1_bounds_chi():
    largest = 0.0
    for s in samples():
        ratio = abs(s.chi) / np.linalg.norm(s.z) / zeta_1(s.law.gains, s.law.model.body.m)
        assert ratio <= 1 + 1e-9
        largest = max(largest, ratio)
    assert largest > 0.7


def test_23_the_rule_of_vertices_is_attained_where_1_1_is_the_largest():
    law, _ = random_law(np.random.default_rng(1))
    g = dataclasses.replace(law.gains, alpha1=1.0, alpha2=2.0, alpha3=3.0)
    bound = zeta_1(g, 1.0)
    coefficients = np.array(
        [g.alpha1, g.alpha2**2 - g.alpha1**2, -g.alpha2 * (g.alpha1 + g.alpha3)]
    )
    assert bound == pytest.approx(np.linalg.norm(coefficients))
    plant = dataclasses.replace(law.model, body=MassSpring(1.0, 100.0, 0.206))
    law = dataclasses.replace(law, model=plant, gains=g)
    eta_m, e_m, u_f = 1e-4 * coefficients
    x_m_dot = -(eta_m - g.alpha1 * np.tanh(e_m) - g.alpha2 * u_f)
    x = np.array([0.3, 1.2, 0.0, 0.0, TARGET.x_md - e_m, x_m_dot, 0.0, u_f, 1.0, *np.ones(10)])
    found = seen_at()(law, x)
    assert abs(found["chi"][0]) / np.linalg.norm(found["z"]) == pytest.approx(bound, rel=1e-5)


def test_53_bounds_V_dot_in_both_readings():
    for s in samples():
        g, high = s.law.gains, s.d.bounds.zeta_K[1]
        free = (high * s.gap) ** 2 / (4 * g.alpha2) if s.gap < 0 else 0.0
        eta_m = s.z[0]
        for alpha, rest in (
            (g.alpha[0], s.by_axis(np.array(g.alpha), np.array(g.k3))),
            (min(g.alpha), s.by_norm()),
        ):
            damped = -(g.alpha2 - high**2 / (4 * alpha)) * eta_m**2
            assert respected(s.common + damped + free + rest, s)


def test_55_bounds_V_dot_with_the_corrected_epsilon_x():
    worst = -np.inf
    for s in samples():
        g = s.law.gains
        square = (np.sqrt(2 * s.V / A1) + 1) ** 2
        left = min(k3 - square / alpha for k3, alpha in zip(g.k3, g.alpha, strict=True))
        e, r = np.linalg.norm(s.e_r), np.linalg.norm(s.r_r)
        bound = s.common - min(g.alpha) * np.tanh(e) ** 2 + s.epsilon_x(Corrected())
        if left > 0:
            bound -= left * np.tanh(r) ** 2
        else:
            bound -= left * (np.array(s.r_r) @ np.tanh(s.r_r))
        assert respected(bound, s)
        worst = max(worst, s.V_dot - bound)
    assert worst < 0


def test_71_bounds_V_dot_in_contact_with_the_square_of_erratum_E18():
    touching = [s for s in samples() if s.gap >= 0]
    for s in touching:
        g, high = s.law.gains, s.d.bounds.zeta_K[1]
        damped = -(2 * g.alpha2 - high**2 / (4 * g.alpha[0])) * s.z[0] ** 2
        rest = s.by_axis(np.array(g.alpha), np.array(g.k3))
        assert respected(s.common + damped + rest, s)


def soft_law(alpha):
    """A law on a contact of 10 N/m, ``k1`` as (26) asks of it, and its bounds."""
    gains = Gains(1.0, 1e6, (5.0, 5.0), 0.01, 1.0, 0.01, (alpha, alpha), Gamma=1.0)
    k1 = (3 + 2 / 4 * zeta_1(gains, 0.1) ** 2) / 0.1
    body, contact = MassSpring(0.1, 10.0, 0.206), LinearSpring(K_I=10.0)
    plant = dataclasses.replace(MODEL, body=body, contact=contact)
    bounds = Assumptions(0.1, 0.1 + 1e-9, (10.0, 10.0 + 1e-9), (1.0, 2.0), -9.0, 1.0, 0.05)
    return told(plant, dataclasses.replace(gains, k1=float(k1))), bounds


def state(law, tip, eta_m, u_f):
    """A state with ``e_m = 0``, ``r_r = 0`` and true estimates."""
    q = np.array(law.model.arm.inverse(tip, "+"))
    x_m_dot, truth = law.gains.alpha2 * u_f - eta_m, true_theta_r(law.model)
    x = np.array([*q, 0.0, 0.0, TARGET.x_md, x_m_dot, 0.0, u_f, law.model.theta_dk, *truth])
    s, memory = split_state(law, x)
    e = errors_at(law, s, AdaptiveState(**memory))
    wanted = e.x_rd_dot + np.array(law.gains.alpha) * e.e_r
    x[2:4] = np.linalg.solve(law.model.arm.J(s.q), wanted)
    return x


def test_71_as_printed_is_no_bound():
    """Erratum E18: ``zeta_K`` without its square, at a state where that decides.

    The mass runs away at 1 m/s, pressed by a tip that is 2.5 m ahead of where it should be.
    """
    law, bounds = soft_law(alpha=1.0)
    x_rd1 = float(law.x_rd1(TARGET.x_md, 0.0, law.model.theta_dk))
    found = seen_at()(law, state(law, (x_rd1 + 2.5, TARGET.x_rd2), eta_m=-1.0, u_f=0.0))
    assert [*found["z"], *found["e_r"]] == pytest.approx([-1, 0, 0, -2.5, 0])
    assert found["r_r"] == pytest.approx([0, 0], abs=1e-6) and found["gap"][0] > 2.5
    d = design(law, bounds, TARGET.x_md, x_rd1)
    beta = evaluate(d, Corrected()).constant("beta").value
    shared = -beta - np.tanh(2.5) ** 2
    printed, corrected = shared - (1 - 10 / 4), shared - (2 - 10**2 / 4)
    assert printed < found["V_dot"][0] <= corrected
    assert found["V_dot"][0] == pytest.approx(7.0, abs=0.1)


def test_55_as_printed_is_no_bound_where_the_tip_reaches_far_back():
    """Erratum E9: ``zeta_xm`` alone, where the tip is 3.9 m behind the mass, as it is asked to."""
    law, bounds = soft_law(alpha=30.0)
    ahead = law.model.body.Y_d(TARGET.x_md) * law.model.theta_dk
    u_f = (3.9 + ahead) / (law.gains.k1 * law.gains.k2)
    x_rd1 = float(law.x_rd1(TARGET.x_md, u_f, law.model.theta_dk))
    found = seen_at()(law, state(law, (x_rd1, TARGET.x_rd2), eta_m=-6.5, u_f=u_f))
    assert found["gap"][0] == pytest.approx(-3.9)
    assert [*found["e_r"], *found["r_r"]] == pytest.approx([0.0] * 4, abs=1e-5)
    d = design(law, bounds, TARGET.x_md, x_rd1)
    reading = evaluate(d, Corrected())
    assert all(reading.condition(n).holds for n in ("(26)", "(37)", "(38), first"))
    common = -reading.constant("beta").value * found["z"] @ found["z"]
    printed, corrected = Printed().epsilon_x(d), Corrected().epsilon_x(d)
    assert common + printed < found["V_dot"][0] <= common + corrected


def test_48_lambda_1_as_printed_is_too_small_where_e_r_decides():
    """Erratum E5, with ``a2 = m_u = 1`` and ``k2 zeta_K_upper = 0.5``."""
    e_r = np.array([0.1, 0.05])
    held = e_r @ e_r + np.log(np.cosh(e_r)).sum()
    s = samples()[0]
    d = dataclasses.replace(
        s.d,
        gains=dataclasses.replace(s.d.gains, k2=0.5),
        bounds=dataclasses.replace(s.d.bounds, m_l=0.9, m_u=1.0, zeta_K=(0.9, 1.0)),
        inertia=dataclasses.replace(s.d.inertia, a2=1.0),
    )
    assert Printed().lambda_1(d) == 1.0 and Corrected().lambda_1(d) == 1.5
    assert Printed().lambda_1(d) * (e_r @ e_r) < held <= Corrected().lambda_1(d) * (e_r @ e_r)


def test_48_bounds_V_with_the_corrected_lambda_1_and_zeta_theta():
    """The estimates lie in their boxes here, and so does the truth."""
    shares = []
    for s in samples():
        e_f, e_m = np.arctanh(s.z[2]), np.arctanh(s.z[1])
        z_bar = np.array([*s.r_r, *s.e_r, s.z[0], e_m, e_f])
        f = Corrected()
        bound = f.lambda_1(s.d) * z_bar @ z_bar + f.zeta_theta(s.d)
        shares.append(s.V / bound)
    assert 1e-3 < max(shares) <= 1


def test_epsilon_x_as_printed_is_a_bound_just_where_erratum_E9_says():
    s = samples()[0]
    for zeta_xr, enough in ((-0.9, True), (-1.0, True), (-1.1, False), (-5.0, False)):
        d = dataclasses.replace(
            s.d, bounds=dataclasses.replace(s.d.bounds, zeta_xr=zeta_xr, zeta_xm=1.0)
        )
        farthest = (d.bounds.zeta_K[1] * (1.0 - zeta_xr)) ** 2 / (4 * d.gains.alpha2)
        assert Corrected().epsilon_x(d) == pytest.approx(farthest)
        assert (Printed().epsilon_x(d) >= farthest * (1 - 1e-12)) == enough


def test_61_holds_without_the_factor_5():
    """``atanh(sqrt(v))^2`` is convex and superadditive (erratum E11)."""
    rng = np.random.default_rng(2)
    closest = 0.0
    for _ in range(2000):
        y = rng.normal(size=5) ** 3
        y *= rng.uniform(0, 0.999) / np.linalg.norm(y)
        state = np.array([y[0], *np.arctanh(y[1:])])
        bound = np.arctanh(np.linalg.norm(y))
        assert np.linalg.norm(state) <= bound * (1 + 1e-12)
        closest = max(closest, np.linalg.norm(state) / bound)
    assert closest > 0.99
