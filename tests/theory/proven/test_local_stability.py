"""Condition LOC against the eigenvalues of the linearised lossless loop."""

from __future__ import annotations

import dataclasses
import functools

import casadi as ca
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from alight.control import ForceLimiting, Gains, Unsaturated
from alight.models import LinearSpring, MassSpring, Plant
from alight.simulation.continuous import continuous_rates
from alight.theory import linearise, loc_margin
from tests.control.cases import (
    EXPERIMENT_1,
    EXPERIMENT_2,
    PLANT,
    TARGET,
    gains,
    told,
    true_theta_r,
)
from tests.lifted import Evaluate, lifted
from tests.strategies import log_between

MANY = settings(max_examples=300)


def plant_with(m: float, K_I: float, k_s: float = 350.0) -> Plant:
    body = MassSpring(m, k_s, PLANT.body.x_0)
    return dataclasses.replace(PLANT, body=body, contact=LinearSpring(K_I=K_I))


def stiff_plants() -> st.SearchStrategy[Plant]:
    return st.builds(
        plant_with, log_between(0.3, 20.0), log_between(5e3, 5e5), log_between(100.0, 2e3)
    )


def mass_and_filter(g: Gains, kappa: float, compression: float) -> np.ndarray:
    """The mass, its filter and ``theta_dk_hat`` under perfect tracking, linearised by hand.

    State: e_m, e_m_dot, u_f, theta_dk_hat; ``kappa`` is ``K_I / m``.
    """
    force = np.array([g.k2, 0.0, -g.k1 * g.k2, compression])
    eta_m = np.array([g.alpha1, 1.0, g.alpha2, 0.0])
    u_f_dot = np.array([g.alpha2, 0.0, -g.alpha3, 0.0]) - g.k1 * eta_m
    return np.array([[0.0, 1.0, 0.0, 0.0], -kappa * force, u_f_dot, g.Gamma * compression * eta_m])


def characteristic(g: Gains, kappa: float) -> np.ndarray:
    """Roots of the cubic of finding F1."""
    return np.roots(
        [
            1.0,
            g.k1 * g.alpha2 + g.alpha3,
            kappa * g.k2 * (1 + g.k1**2),
            kappa * g.k2 * (g.alpha3 + g.k1**2 * g.alpha1),
        ]
    )


@functools.cache
def slope(cls: type) -> Evaluate:
    """Linearisation as `linearise` takes it, with the numbers of the law as inputs."""

    def expressions(law: ForceLimiting, column: ca.SX) -> dict[str, ca.SX]:
        moving, _ = continuous_rates(law.model, law, column)
        return {"A": ca.jacobian(moving, column), "x_dot": moving}

    return lifted(told(cls=cls), {"x": 19}, expressions)


def eigenvalues(law: ForceLimiting, at: np.ndarray) -> np.ndarray:
    found = slope(type(law))(law, at)
    scale = 1.0 + np.abs(found["A"]).max()
    assert np.abs(found["x_dot"]).max() < 1e-9 * scale
    return np.linalg.eigvals(found["A"])


def equilibrium(law: ForceLimiting) -> np.ndarray:
    """Rest on target with true parameters, typed."""
    plant = law.model
    held = plant.body.k_s * (TARGET.x_md - plant.body.x_0)
    q = plant.arm.inverse((TARGET.x_md + held / plant.contact.K_I, TARGET.x_rd2), "-")
    theta_dk = plant.body.k_s / plant.contact.K_I
    return np.array([*q, 0, 0, TARGET.x_md, 0, 0, 0, theta_dk, *true_theta_r(plant)])


def assert_among(roots: np.ndarray, found: np.ndarray, rounding: float) -> None:
    """Each root is one of the eigenvalues, to rounding of the largest."""
    size = np.abs(found).max()
    for root in roots:
        assert np.abs(found - root).min() <= rounding * size


KNOWN = {"Gamma": 1e-12}
"""``theta_dk_hat`` stays at the truth: the three states that finding F1 speaks of."""


# The condition


@MANY
@given(gains(), stiff_plants(), st.sampled_from([ForceLimiting, Unsaturated]))
def test_LOC_predicts_whether_the_loop_is_locally_stable(g, plant, cls):
    g = dataclasses.replace(g, **KNOWN)
    margin = loc_margin(g)
    assume(abs(margin) > 0.05 * g.alpha1)
    law = told(plant, g, cls)
    found = eigenvalues(law, equilibrium(law))
    growth, rounding = found.real.max(), 1e-9 * np.abs(found).max()
    if margin > 0:
        assert growth <= rounding
    else:
        assert growth > 10 * rounding
        root = characteristic(g, plant.contact.K_I / plant.body.m).real.max()
        assert growth == pytest.approx(root, abs=rounding)


@MANY
@given(gains(), log_between(1e2, 1e7))
def test_LOC_is_the_routh_criterion_of_the_characteristic_polynomial(g, kappa):
    margin = loc_margin(g)
    assume(abs(margin) > 1e-3 * g.alpha1)
    roots = characteristic(g, kappa)
    assert (roots.real.max() > 0) == (margin < 0)


def test_both_signs_of_the_margin_are_common():
    rng = np.random.default_rng(0)
    margins = []
    for _ in range(200):
        k1, alpha1, alpha2 = np.exp(rng.uniform(np.log([0.1, 1, 1]), np.log([10, 100, 100])))
        margins.append(
            loc_margin(dataclasses.replace(EXPERIMENT_1, k1=k1, alpha1=alpha1, alpha2=alpha2))
        )
    assert 0.15 < np.mean(np.array(margins) < 0) < 0.85


# Where the eigenvalues come from


@given(gains(), stiff_plants())
def test_the_loop_holds_the_roots_of_the_characteristic_polynomial(g, plant):
    law = told(plant, dataclasses.replace(g, **KNOWN))
    roots = characteristic(law.gains, plant.contact.K_I / plant.body.m)
    assert_among(roots, eigenvalues(law, equilibrium(law)), 1e-8)


@given(gains(), stiff_plants())
def test_adaptation_of_theta_dk_adds_one_state_to_them(g, plant):
    law = told(plant, g)
    by_hand = mass_and_filter(g, plant.contact.K_I / plant.body.m, TARGET.x_md - plant.body.x_0)
    assert_among(np.linalg.eigvals(by_hand), eigenvalues(law, equilibrium(law)), 1e-7)


@given(gains(), stiff_plants())
def test_the_robot_part_never_grows(g, plant):
    """What is left of the spectrum is that of r_r, e_r and theta_r_hat: V_r forbids growth."""
    law = told(plant, g)
    found = eigenvalues(law, equilibrium(law))
    by_hand = mass_and_filter(g, plant.contact.K_I / plant.body.m, TARGET.x_md - plant.body.x_0)
    for root in np.linalg.eigvals(by_hand):
        found = np.delete(found, np.abs(found - root).argmin())
    assert len(found) == 15
    assert found.real.max() <= 1e-7 * np.abs(found).max()


# `linearise` itself


@pytest.mark.parametrize("seed", range(4))
def test_linearise_finds_the_equilibrium_and_these_eigenvalues(seed):
    rng = np.random.default_rng(seed)
    alpha1, k1 = rng.uniform(5, 60), rng.uniform(0.3, 3)
    law = told(
        plant_with(rng.uniform(0.5, 5), rng.uniform(1e4, 1e5)),
        dataclasses.replace(EXPERIMENT_1, alpha1=alpha1, k1=k1),
    )
    found = linearise(law.model, law, "-")
    np.testing.assert_allclose(found.state, equilibrium(law), rtol=1e-12, atol=1e-15)
    again = eigenvalues(law, found.state)
    assert found.growth == found.eigenvalues.real.max()
    assert_among(again, found.eigenvalues, 1e-9)
    assert_among(found.eigenvalues, again, 1e-9)


def test_the_elbow_changes_the_pose_and_not_the_mass():
    law = told(gains=EXPERIMENT_1)
    up, down = linearise(PLANT, law, "+"), linearise(PLANT, law, "-")
    assert up.state[1] == pytest.approx(-down.state[1])
    assert up.growth == pytest.approx(down.growth, rel=1e-9)


# The experiments


@pytest.mark.parametrize(
    ("m", "growth", "frequency"), [(1.0, 6.905, 485.4), (10.0, 6.5, 155.0)], ids=["1 kg", "10 kg"]
)
def test_the_printed_gains_42_are_unstable_on_the_lossless_plant(m, growth, frequency):
    """Finding F1 of the audit, at K_I = 1e5 N/m."""
    law = told(plant_with(m, 1e5), EXPERIMENT_1)
    found = linearise(law.model, law, "-")
    worst = found.eigenvalues[found.eigenvalues.real.argmax()]
    assert found.growth == pytest.approx(growth, rel=1e-2 if m == 10.0 else 2e-4)
    assert abs(worst.imag) == pytest.approx(frequency, rel=1e-2 if m == 10.0 else 2e-4)
    assert loc_margin(EXPERIMENT_1) == pytest.approx(-17.4)


@pytest.mark.parametrize("cls", [ForceLimiting, Unsaturated])
def test_the_gains_of_experiment_2_are_stable_on_the_lossless_plant(cls):
    law = told(plant_with(1.0, 1e5), EXPERIMENT_2, cls)
    found = linearise(law.model, law, "-")
    assert found.growth <= 1e-9 * np.abs(found.eigenvalues).max()
    assert loc_margin(EXPERIMENT_2) == pytest.approx(100 * (0.22 + 1 / 0.22) + 0.001 - 75)


@pytest.mark.parametrize(("m", "enough"), [(1.0, 13.8), (3.5, 47.8), (10.0, 131.9)], ids=str)
def test_a_little_damping_of_the_mass_hides_the_instability(m, enough):
    """Finding F1 gives the smallest damping that stabilises (42) under perfect tracking.

    The law knows nothing of that damping, so that its tracking is not perfect: the whole loop needs
    more of it, within three times as much.
    """

    def growth(damping: float) -> float:
        body = MassSpring(m, 1000.0, PLANT.body.x_0, damping=damping)
        plant = Plant(PLANT.arm, body, LinearSpring(K_I=1e5))
        return linearise(plant, told(plant, EXPERIMENT_1), "-").growth

    def under_perfect_tracking(damping: float) -> float:
        slope = mass_and_filter(EXPERIMENT_1, 1e5 / m, TARGET.x_md - PLANT.body.x_0)
        slope[1, 1] -= damping / m
        return np.linalg.eigvals(slope).real.max()

    assert under_perfect_tracking(0.99 * enough) > 0 > under_perfect_tracking(1.01 * enough)
    assert growth(0.0) > growth(0.5 * enough) > growth(enough) > 0.1
    assert growth(3 * enough) < 1e-9
