"""Friction at the tip: bounded, dissipative, and truly sticking."""

from __future__ import annotations

import functools
from typing import Any

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from alight.models import TipFriction
from alight.simulation.integrate import rk4_step
from alight.symbolic.build import build
from tests.lifted import Evaluate, lifted
from tests.strategies import between, log_between, tip_frictions, vectors

SPEEDS = between(-2.0, 2.0)
SHARES = between(-1.0, 1.0)
NORMAL = log_between(0.1, 500.0)


@given(tip_frictions(), SHARES, SPEEDS)
def test_without_normal_force_there_is_no_friction(friction, share, v):
    assert friction.force(share * friction.deflection, v, 0.0) == 0


@given(SHARES, SPEEDS, NORMAL)
def test_without_a_coefficient_there_is_no_friction(share, v, F_m):
    friction = TipFriction(mu=0.0)
    assert friction.force(share * friction.deflection, v, F_m) == 0


@given(tip_frictions(), SHARES, SPEEDS, NORMAL)
def test_friction_is_bounded_by_coulombs_cone_and_the_damping_of_the_bristle(
    friction, share, v, F_m
):
    """|F_t| <= mu F_m (1 + damping |v| / deflection); the second term acts while z still moves."""
    z = share * friction.deflection
    bound = friction.mu * F_m * (1 + friction.damping * abs(v) / friction.deflection)
    assert abs(friction.force(z, v, F_m)) <= bound * (1 + 1e-12)


@given(tip_frictions(), st.sampled_from([-1.0, 1.0]), between(1e-3, 2.0), NORMAL)
def test_full_sliding_is_coulombs_law(friction, side, speed, F_m):
    z, v = side * friction.deflection, side * speed
    assert friction.force(z, v, F_m) == pytest.approx(side * friction.mu * F_m, rel=1e-12)


@given(tip_frictions(), SHARES, SPEEDS, NORMAL)
def test_friction_changes_sign_with_the_motion(friction, share, v, F_m):
    z = share * friction.deflection
    assert friction.force(-z, -v, F_m) == -friction.force(z, v, F_m)


@given(tip_frictions(), st.sampled_from([-1.0, 1.0]), SPEEDS)
def test_the_bristle_cannot_leave_its_deflection(friction, side, v):
    """On the border the rate of z points inwards, so that |z| <= deflection is invariant."""
    z = side * friction.deflection
    for Lambda in (0.0, 1.0):
        assert side * friction.z_dot(z, v, Lambda) <= 1e-15 * abs(v)
    beyond = 1.5 * z  # an initial value of the user's: it comes back
    assert side * friction.z_dot(beyond, v, 1.0) <= 0 or v * z < 0
    assert side * friction.z_dot(beyond, v, 0.0) < 0


@given(tip_frictions(), SHARES, SPEEDS)
def test_the_bristle_follows_the_tip_below_breakaway(friction, share, v):
    z = share * friction.breakaway * friction.deflection
    assert friction.z_dot(z, v, 1.0) == v
    assert friction.plasticity(z, v) == 0


@given(tip_frictions(), SHARES)
def test_a_free_bristle_relaxes_and_a_resting_tip_leaves_it_alone(friction, share):
    z = share * friction.deflection
    assert friction.z_dot(z, 0.7, 0.0) == -z / friction.response
    assert friction.z_dot(z, 0.0, 1.0) == 0


@given(tip_frictions(), SHARES, SPEEDS, NORMAL)
def test_under_a_constant_normal_force_friction_takes_at_least_what_the_bristle_stores(
    friction, share, v, F_m
):
    z = share * friction.deflection
    stiffness = friction.mu * F_m / friction.deflection
    taken = friction.force(z, v, F_m) * v
    stored = stiffness * z * friction.z_dot(z, v, 1.0)
    assert taken >= stored - 1e-12 * (abs(taken) + abs(stored))


def bent_by(friction: Any, F_m: Any, v: Any, z: Any, dt: Any) -> tuple[Any, Any]:
    """One step of the midpoint rule: the next bristle deflection, and the work of friction."""
    mid = z + dt / 2 * friction.z_dot(z, v, 1.0)
    return z + dt * friction.z_dot(mid, v, 1.0), dt * friction.force(mid, v, F_m) * v


@functools.cache
def work_of_friction(n: int) -> Evaluate:
    def expressions(friction: Any, v: Any, F_m: Any, dt: Any) -> dict[str, Any]:
        z = work = 0.0
        for i in range(n):
            z, taken = bent_by(friction, F_m[i], v[i], z, dt)
            work += taken
        return {"work": work}

    return lifted(TipFriction(), {"v": n, "F_m": n, "dt": 1}, expressions)


@given(tip_frictions(), vectors(5, 1.0), vectors(5, 1.0))
def test_a_normal_force_that_rises_can_free_no_more_than_its_rise_times_half_mu_deflection(
    friction, motion, pressing
):
    """Work of friction over any motion >= -(mu deflection / 2) x (all rises of F_m together).

    The force is mu F_m z / deflection: pressing harder on a bent bristle stiffens it, which is the
    one way in which this model can give energy. With a constant F_m it gives none.
    """
    n, end = 1000, 0.2
    share, knots = (np.arange(n) + 0.5) / n, np.linspace(0.0, 1.0, 5)
    v = np.interp(share, knots, motion) * 50 * friction.deflection / end
    F_m = 51.0 + 50.0 * np.interp(share, knots, pressing)
    work = work_of_friction(n)(friction, v, F_m, end / n)["work"][0]
    rises = np.clip(np.diff(F_m), 0.0, None).sum()
    travel = friction.mu * F_m.max() * np.abs(v).sum() * end / n
    assert work >= -friction.mu * friction.deflection / 2 * rises - 1e-3 * travel


def test_that_bound_is_what_bending_lightly_and_unbending_under_pressure_frees():
    friction = TipFriction(mu=0.3, deflection=1e-4, damping=0.0, breakaway=0.9)
    z, light, heavy = 0.9e-4, 10.0, 60.0
    stored, freed = (friction.force(z, 0.0, F_m) * z / 2 for F_m in (light, heavy))
    bound = friction.mu * friction.deflection / 2 * (heavy - light)
    assert freed - stored == pytest.approx(friction.breakaway**2 * bound, rel=1e-12)


# True sticking: a block of 2 kg under 40 N of normal force, pulled along X2

FRICTION = TipFriction(mu=0.3, deflection=1e-4, damping=1e-3, breakaway=0.7)
F_M, MASS = 40.0, 2.0
SLIDING = FRICTION.mu * F_M
BREAKAWAY = FRICTION.breakaway * SLIDING


@functools.cache
def block(friction: TipFriction, dt: float) -> ca.Function:
    """One step of the block: position, velocity, bristle; the pull runs between two values."""
    state, pull = ca.SX.sym("state", 3), ca.SX.sym("pull", 2)

    def rates(timed: ca.SX) -> ca.SX:
        v, z, share = timed[1], timed[2], timed[3]
        now = pull[0] + share * (pull[1] - pull[0])
        force = friction.force(z, v, F_M)
        return ca.vertcat(v, (now - force) / MASS, friction.z_dot(z, v, 1.0), 1 / dt)

    following = rk4_step(rates, ca.vertcat(state, 0), dt)[:3]
    return build("block", {"state": state, "pull": pull}, {"following": following})


def pulled(
    load: float, end: float, ripple: float = 0.0, friction: TipFriction = FRICTION
) -> tuple[np.ndarray, np.ndarray]:
    """Time and (position, velocity, bristle) of the block under a load that rises within 0.2 s."""
    dt = 2e-4
    t = np.arange(round(end / dt)) * dt
    pull = [load * np.minimum(at / 0.2, 1.0) + ripple * np.sin(300.0 * at) for at in (t, t + dt)]
    states = block(friction, dt).mapaccum(len(t))(np.zeros(3), np.array(pull))
    return t + dt, states.full()


@pytest.mark.parametrize("share", [-0.95, 0.3, 0.95])
def test_below_breakaway_the_tip_sticks_without_creep(share):
    t, (x, _, z) = pulled(share * BREAKAWAY, end=100.0)
    settled = x[t > 1.0]
    elastic = share * BREAKAWAY * FRICTION.deflection / SLIDING
    assert np.ptp(settled) < 1e-6 * FRICTION.deflection
    assert settled[-1] == pytest.approx(elastic, rel=1e-6)
    np.testing.assert_allclose(x, z, atol=1e-6 * FRICTION.deflection)


def test_below_breakaway_a_trembling_load_does_not_make_the_tip_walk():
    """The flaw of the LuGre model: it drifts under any vibration. Here the tip comes back."""
    t, (x, _, z) = pulled(0.6 * BREAKAWAY, end=10.0, ripple=0.2 * BREAKAWAY)
    assert np.ptp(x[t > 1.0]) > 0.01 * FRICTION.deflection  # it does tremble
    np.testing.assert_allclose(x, z, atol=1e-6 * FRICTION.deflection)
    yielding = TipFriction(mu=0.3, deflection=1e-4, damping=1e-3, breakaway=0.01)
    _, (x, _, z) = pulled(0.6 * BREAKAWAY, end=10.0, ripple=0.2 * BREAKAWAY, friction=yielding)
    assert (x - z)[-1] > 10 * FRICTION.deflection  # a bristle that yields early walks


@pytest.mark.parametrize("share", [-1.2, 1.05, 2.0])
def test_above_coulombs_limit_the_tip_slides_with_the_excess(share):
    t, (_, v, z) = pulled(share * SLIDING, end=2.0)
    late = t > 1.0
    acceleration = np.gradient(v[late], t[late])
    excess = (share - np.sign(share)) * SLIDING / MASS
    np.testing.assert_allclose(acceleration, excess, rtol=1e-4)
    np.testing.assert_allclose(z[late], np.sign(share) * FRICTION.deflection, rtol=1e-6)


@given(tip_frictions(), st.lists(SPEEDS, min_size=3, max_size=8))
def test_the_bristle_stays_within_its_deflection_along_any_motion(friction, speeds):
    dt = 0.05 * friction.deflection  # [s]: at most a tenth of the deflection in a step
    z = 0.0
    for v in speeds:
        for _ in range(60):
            mid = z + dt / 2 * friction.z_dot(z, v, 1.0)
            z += dt * friction.z_dot(mid, v, 1.0)
            assert abs(z) <= friction.deflection * (1 + 1e-9)
