"""LOC, LOC with adaptation and VTX, one against the other and against linearised closed loops."""

from __future__ import annotations

import dataclasses
import functools

import casadi as ca
import numpy as np
import pytest
from hypothesis import given

from alight.control import ForceLimiting, Gains
from alight.symbolic.parameters import rebind
from alight.theory import linearise, loc_margin
from alight.theory.proven import loc_adapting_margin, vtx_margin
from tests.control.cases import EXPERIMENT_1, EXPERIMENT_2, STABLE, TARGET, gains, told
from tests.lifted import Evaluate, lifted
from tests.strategies import between, log_between
from tests.theory.proven.designs import Loops, log_uniform, random_gains, random_loops
from tests.theory.proven.test_local_stability import plant_with

MANY = 10_000
ROUNDING = 1e-13
"""Of an eigenvalue, relative to the largest of its loop."""

DESTABILISED = Gains(
    k1=1.0,
    k2=0.47,
    k3=(95.0, 5.0),
    alpha1=15.0,
    alpha2=10.0,
    alpha3=0.1,
    alpha=(50.0, 4.5),
    Gamma=1.0,
)
"""LOC holds, with a margin of 5.1 1/s; ``k1 alpha2 < alpha1``."""


def verdicts(loops: Loops, margins: np.ndarray, terms: np.ndarray) -> np.ndarray:
    """Compare the sign of each margin, where above its rounding, with the growth of its loop."""
    growth = loops.eigenvalues.real.max(axis=1)
    grows = growth > ROUNDING * np.abs(loops.eigenvalues).max(axis=1)
    clear = np.abs(margins) > 1e-9 * terms
    assert clear.sum() >= 0.999 * len(margins)
    np.testing.assert_array_equal(grows[clear], margins[clear] < 0)
    return grows


def test_LOC_is_the_sign_of_the_growth_of_ten_thousand_linearised_loops():
    loops = random_loops(1, MANY, adapting=False)
    g = loops.gains
    grows = verdicts(loops, loc_margin(g), g.alpha1 + g.alpha2 * (g.k1 + 1 / g.k1) + g.alpha3)
    assert 0.1 < grows.mean() < 0.9
    certified = vtx_margin(g, 1.0, loops.kappa) > 0
    assert certified.sum() > 100
    assert not grows[certified].any()


def test_LOC_with_adaptation_is_that_sign_while_theta_dk_hat_adapts():
    loops = random_loops(2, MANY, adapting=True)
    g = loops.gains
    margins = loc_adapting_margin(g, loops.kappa, loops.compression)
    terms = np.abs(margins - loc_margin(g)) + g.alpha1 + g.alpha2 * (g.k1 + 1 / g.k1)
    grows = verdicts(loops, margins, terms)
    assert 0.1 < grows.mean() < 0.9
    assert (grows & (loc_margin(g) > 0)).sum() > 300  # LOC alone would have let these pass
    certified = vtx_margin(g, 1.0, loops.kappa) > 0
    assert certified.sum() > 100
    assert not grows[certified].any()


def test_VTX_implies_LOC_with_adaptation_and_that_implies_LOC():
    """The first by Proposition B and LaSalle, the second by algebra: a million designs each."""
    rng = np.random.default_rng(3)
    g = random_gains(rng, 1_000_000)
    kappa, D = log_uniform(rng, 10.0, 1e7, 1_000_000), log_uniform(rng, 1e-3, 1.0, 1_000_000)
    certified = vtx_margin(g, 1.0, kappa) > 0
    adapting, plain = loc_adapting_margin(g, kappa, D) > 0, loc_margin(g) > 0
    assert certified.sum() > 20_000
    assert adapting[certified].all()
    assert plain[adapting].all()
    assert (adapting & ~certified).any() and (plain & ~adapting).any()


# Where LOC with adaptation comes from


@functools.cache
def tracked() -> Evaluate:
    """The mass, its filter and ``theta_dk_hat`` with ``x_r1 = x_rd1``, from law and plant."""

    def expressions(law: ForceLimiting, x: ca.SX) -> dict[str, ca.SX]:
        x_m, x_m_dot, u_f, theta_dk_hat = (x[i] for i in range(4))
        plant = law.model
        _, u_f_dot, theta_dot = law.filter_rates(x_m, x_m_dot, u_f, theta_dk_hat)
        pressed = plant.contact.pressing(law.x_rd1(x_m, u_f, theta_dk_hat) - x_m, 0.0)
        x_m_ddot = plant.body.acceleration(x_m, x_m_dot, pressed)
        moving = ca.vertcat(x_m_dot, x_m_ddot, u_f_dot, theta_dot)
        return {"A": ca.jacobian(moving, x), "x_dot": moving}

    return lifted(told(), {"x": 4}, expressions)


def quartic(g: Gains, kappa: float, D: float) -> np.ndarray:
    """Coefficients of the characteristic polynomial, typed."""
    grown = g.Gamma * D**2 * kappa
    return np.array(
        [
            1.0,
            g.k1 * g.alpha2 + g.alpha3,
            kappa * g.k2 * (1 + g.k1**2) + grown,
            kappa * g.k2 * (g.alpha3 + g.k1**2 * g.alpha1) + grown * (g.alpha1 + g.alpha3),
            grown * (g.alpha1 * g.alpha3 + g.alpha2**2),
        ]
    )


@given(gains(), log_between(0.3, 20.0), log_between(5e3, 5e5), log_between(1e-2, 1e4))
def test_its_quartic_is_the_characteristic_polynomial_under_perfect_tracking(g, m, K_I, Gamma):
    g = dataclasses.replace(g, Gamma=Gamma)
    law = told(plant_with(m, K_I), g)
    found = tracked()(law, np.array([TARGET.x_md, 0.0, 0.0, law.model.theta_dk]))
    assert np.abs(found["x_dot"]).max() < 1e-9 * np.abs(found["A"]).max()
    typed = quartic(g, K_I / m, TARGET.x_md - law.model.body.x_0)
    size = np.abs(np.linalg.eigvals(found["A"])).max()
    for s in size * np.array([0.0, 0.3, -0.7, 1.0, 1.0j, -2.0]):
        determinant = np.linalg.det(s * np.eye(4) - found["A"])
        scale = np.polyval(typed, size)
        assert abs(determinant - np.polyval(typed, s)) <= 1e-10 * scale


@given(gains(), log_between(1e2, 1e7), between(0.005, 0.1), log_between(1e-3, 1e6))
def test_its_margin_is_the_routh_criterion_of_the_quartic(g, kappa, D, Gamma):
    g = dataclasses.replace(g, Gamma=Gamma)
    _, A, B, C, E = quartic(g, kappa, D)
    scale = kappa * g.k2 * g.k1**2 * C
    margin = loc_adapting_margin(g, kappa, D)
    size = (A * B * C + C**2 + A**2 * E) / scale
    assert margin == pytest.approx(((A * B - C) * C - A**2 * E) / scale, abs=1e-12 * size)


@given(gains(), log_between(1e2, 1e7), log_between(1.01, 100.0))
def test_a_stiffer_contact_or_a_lighter_mass_never_harms(g, kappa, ratio):
    less, more = (loc_adapting_margin(g, k, 0.03) for k in (kappa, ratio * kappa))
    assert less <= more + 1e-12 * abs(more)


def test_without_adaptation_it_is_LOC():
    slow = dataclasses.replace(EXPERIMENT_1, Gamma=1e-12)
    assert loc_adapting_margin(slow, 1e4, 0.03) == pytest.approx(loc_margin(slow), rel=1e-9)


# What adaptation does


def test_adaptation_can_destabilise_a_loop_that_satisfies_LOC():
    """A result: LOC does not suffice while theta_dk_hat adapts; slow adaptation is harmless."""
    plant = plant_with(1.0, 1e5)
    fast = dataclasses.replace(DESTABILISED, Gamma=1e4)
    growth = {g.Gamma: linearise(plant, told(plant, g), "-").growth for g in (DESTABILISED, fast)}
    assert loc_margin(fast) == loc_margin(DESTABILISED) == pytest.approx(5.1)
    assert growth[1.0] < 1e-9 < 1.0 < growth[1e4]
    assert loc_adapting_margin(fast, 1e5, 0.03) < 0 < loc_adapting_margin(DESTABILISED, 1e5, 0.03)


def test_it_does_so_at_every_stiffness_where_k1_alpha2_lies_below_alpha1():
    kappa = np.geomspace(1e-2, 1e12, 200)
    fast = rebind(DESTABILISED, Gamma=1e4)
    assert (loc_adapting_margin(fast, kappa, 0.03) < 0).all()


@pytest.mark.parametrize("g", [EXPERIMENT_2, STABLE], ids=["experiment 2", "stable"])
def test_the_adaptation_of_the_experiments_is_too_slow_to_matter(g):
    plain, adapting = loc_margin(g), loc_adapting_margin(g, 2e4, 0.03)
    assert adapting == pytest.approx(plain, rel=1e-2)
