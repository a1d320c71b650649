"""Contact laws: (7)-(8) and the two damped ones never pull, and never give energy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from alight.errors import InvalidParameters
from alight.models import HuntCrossley, KelvinVoigt, LinearSpring, MassSpring
from alight.simulation.integrate import dormand_prince_step
from alight.symbolic.derive import jacobian
from alight.symbolic.parameters import rebind
from tests.strategies import (
    CONTACT_LAWS,
    between,
    contact_laws,
    hunt_crossleys,
    kelvin_voigts,
    linear_springs,
    log_between,
    vectors,
)

LAWS = pytest.mark.parametrize("law", list(CONTACT_LAWS), ids=lambda law: law.__name__)
GAPS = st.one_of(between(-1e-2, 1e-2), st.just(0.0))
PENETRATIONS = log_between(1e-9, 1e-2)
SPEEDS = between(-3.0, 3.0)


@LAWS
@given(st.data(), GAPS, SPEEDS)
def test_a_contact_pushes_and_never_pulls(law, data, gap, gap_dot):
    contact = data.draw(CONTACT_LAWS[law]())
    assert contact.force(gap, gap_dot) >= 0


# Two phases: what presses, and the guard that says when


@LAWS
@given(st.data(), GAPS, SPEEDS)
def test_the_force_is_what_presses_where_the_guard_is_not_negative(law, data, gap, gap_dot):
    contact = data.draw(CONTACT_LAWS[law]())
    closed = contact.guard(gap, gap_dot) >= 0
    expected = contact.pressing(gap, gap_dot) if closed else 0.0
    assert contact.force(gap, gap_dot) == expected >= 0
    held_closed, held_open = (contact.force(gap, gap_dot, presses) for presses in (1.0, 0.0))
    assert held_closed == contact.pressing(gap, gap_dot) and held_open == 0


@LAWS
@given(st.data(), vectors(20, 1e-2), vectors(20, 3.0))
def test_arrays_of_gaps_give_the_forces_of_each(law, data, gaps, rates):
    contact = data.draw(CONTACT_LAWS[law]())
    np.testing.assert_allclose(
        contact.force(gaps, rates),
        [contact.force(gap, rate) for gap, rate in zip(gaps, rates, strict=True)],
        rtol=1e-14,
    )


@LAWS
@given(st.data(), PENETRATIONS, SPEEDS, SPEEDS)
def test_a_contact_presses_inside_the_body_unless_it_lets_go_and_never_outside(
    law, data, gap, gap_dot, slower
):
    """At one depth the contact closes again, if it has let go, as soon as it opens more slowly."""
    contact = data.draw(CONTACT_LAWS[law]())
    assert contact.guard(-gap, gap_dot) < 0
    assert contact.guard(gap, abs(gap_dot)) >= 0
    low, high = sorted((gap_dot, slower))
    assert (contact.guard(gap, low) < 0) or (contact.guard(gap, high) >= 0)


@LAWS
@given(st.data(), PENETRATIONS, SPEEDS, log_between(1e-6, 1e-3))
def test_while_it_presses_the_force_has_no_kink(law, data, gap, gap_dot, share):
    """Held closed, a law of whole exponent is a polynomial within the body: third differences."""
    contact = data.draw(CONTACT_LAWS[law]())
    if isinstance(contact, HuntCrossley):
        contact = rebind(contact, exponent=1.0)
    steps = np.array([-2.0, -1.0, 1.0, 2.0]) * share
    forces = [contact.pressing(gap * (1 + h), gap_dot * (1 + h)) for h in steps]
    third = forces[3] - 2 * forces[2] + 2 * forces[1] - forces[0]
    assert abs(third) <= 1e-12 * max(abs(f) for f in forces) + 1e-300


@LAWS
@given(st.data(), between(-1.0, -1e-300), SPEEDS)
def test_in_free_motion_there_is_neither_force_nor_stored_energy(law, data, gap, gap_dot):
    contact = data.draw(CONTACT_LAWS[law]())
    assert contact.force(gap, gap_dot) == 0
    assert contact.energy(gap) == contact.penetration(gap) == contact.Lambda(gap) == 0


@given(contact_laws(), st.one_of(st.just(0.0), PENETRATIONS))
def test_the_indicator_is_one_from_first_touch_on(contact, gap):  # (8)
    assert contact.Lambda(gap) == 1
    assert contact.penetration(gap) == gap


@given(linear_springs(), GAPS, SPEEDS)
def test_the_linear_spring_is_7(contact, gap, gap_dot):
    assert contact.force(gap, gap_dot) == contact.K_I * contact.Lambda(gap) * gap


@given(linear_springs(), GAPS, GAPS, SPEEDS)
def test_the_linear_spring_is_continuous_with_its_stiffness_as_lipschitz_constant(
    contact, gap, other, gap_dot
):
    change = abs(contact.force(gap, gap_dot) - contact.force(other, gap_dot))
    assert change <= contact.K_I * abs(gap - other) * (1 + 1e-12)


@given(linear_springs(), GAPS, SPEEDS)
def test_damped_contacts_without_damping_are_the_linear_spring(contact, gap, gap_dot):
    expected = contact.force(gap, gap_dot)
    for other in (KelvinVoigt(K_I=contact.K_I), HuntCrossley(K_I=contact.K_I)):
        assert other.force(gap, gap_dot) == pytest.approx(expected, rel=1e-15)
        assert other.energy(gap) == pytest.approx(contact.energy(gap), rel=1e-15)


@given(hunt_crossleys(), PENETRATIONS, SPEEDS)
def test_hunt_crossley_is_continuous_at_first_touch_at_any_speed(contact, gap, gap_dot):
    bound = contact.K_I * gap**contact.exponent * (1 + contact.dissipation * abs(gap_dot))
    assert contact.force(gap, gap_dot) <= bound * (1 + 1e-12)
    assert contact.force(0.0, gap_dot) == 0


@given(
    log_between(1e3, 1e6), between(1.0, 500.0), between(0.01, 2.0), PENETRATIONS, between(1.1, 10.0)
)
def test_a_damped_contact_lets_go_of_what_leaves_fast(K_I, damping, dissipation, gap, haste):
    """Where spring and damper together would pull, the force is zero although the bodies touch."""
    for contact, limit in (
        (KelvinVoigt(K_I=K_I, damping=damping), K_I * gap / damping),
        (HuntCrossley(K_I=K_I, exponent=1.5, dissipation=dissipation), 1 / dissipation),
    ):
        assert contact.force(gap, -haste * limit) == 0
        assert contact.force(gap, -0.9 * limit) > 0
        assert contact.Lambda(gap) == 1


@given(kelvin_voigts(), SPEEDS)
def test_kelvin_voigt_jumps_at_first_touch_by_its_damping_force(contact, gap_dot):
    assert contact.force(0.0, gap_dot) == max(contact.damping * gap_dot, 0.0)


@LAWS
@given(st.data(), PENETRATIONS)
def test_at_rest_the_force_is_the_slope_of_the_stored_energy(law, data, gap):
    contact = data.draw(CONTACT_LAWS[law]())
    slope = float(np.squeeze(jacobian(contact.energy, gap)))
    assert contact.force(gap, 0.0) == pytest.approx(slope, rel=1e-12)


@LAWS
@given(st.data(), PENETRATIONS, SPEEDS)
def test_at_every_instant_the_contact_takes_at_least_what_it_stores(law, data, gap, gap_dot):
    """Force times closing speed is no less than the rate of the stored energy: dissipation."""
    contact = data.draw(CONTACT_LAWS[law]())
    taken = contact.force(gap, gap_dot) * gap_dot
    stored = contact.force(gap, 0.0) * gap_dot
    assert taken >= stored - 1e-13 * abs(stored)
    if isinstance(contact, LinearSpring):
        assert taken == stored


@LAWS
@given(st.data(), between(-2e-3, 4e-3), vectors(6, 3e-3), log_between(1.0, 50.0))
def test_the_work_over_a_closed_cycle_of_press_and_release_is_never_negative(
    law, data, offset, harmonics, omega
):
    """Any periodic motion, in and out of contact, by its Fourier series of three harmonics."""
    contact = data.draw(CONTACT_LAWS[law]())
    n = 4000
    phase = 2 * np.pi * np.arange(n) / n
    orders = np.arange(1, 4)
    waves = np.sin(np.outer(phase, orders)), np.cos(np.outer(phase, orders))
    gap = offset + waves[0] @ harmonics[:3] + waves[1] @ harmonics[3:]
    gap_dot = omega * (waves[1] @ (orders * harmonics[:3]) - waves[0] @ (orders * harmonics[3:]))
    power = contact.force(gap, gap_dot) * gap_dot
    work = power.mean() * 2 * np.pi / omega
    # The rectangle rule on a periodic integrand with a kink errs by (2 pi / n)^2 of its size.
    error = np.abs(power).max() * 2 * np.pi / omega * (2 * np.pi / n) ** 2
    assert work >= -10 * error
    damped = getattr(contact, "damping", 0.0) + getattr(contact, "dissipation", 0.0) > 0
    if not damped:
        assert abs(work) <= 10 * error + 1e-3 * contact.energy(gap.max())


def restitution(contact: LinearSpring | KelvinVoigt | HuntCrossley, speed: float) -> float:
    """Speed after over speed before a mass of 1 kg strikes a wall."""
    body = MassSpring(m=1.0, k_s=1.0, x_0=0.0)
    dt = 0.005 / np.sqrt(contact.K_I)

    def rates(state: np.ndarray) -> np.ndarray:
        return np.array([state[1], -contact.force(state[0], state[1]) / body.m])

    state = np.array([0.0, speed])
    while state[0] >= 0:
        state = dormand_prince_step(rates, state, dt)
    return -state[1] / speed


@pytest.mark.parametrize("speed", [0.1, 1.0])
def test_a_bounce_is_elastic_without_damping_and_weaker_with_more_of_it(speed):
    assert restitution(LinearSpring(K_I=1e4), speed) == pytest.approx(1.0, abs=1e-6)
    families = (
        [KelvinVoigt(K_I=1e4, damping=c) for c in (0.0, 20.0, 60.0, 150.0)],
        [HuntCrossley(K_I=1e4, exponent=1.5, dissipation=c) for c in (0.0, 0.2, 1.0, 3.0)],
    )
    for family in families:
        bounces = [restitution(contact, speed) for contact in family]
        assert bounces[0] == pytest.approx(1.0, abs=1e-6)
        assert bounces == sorted(bounces, reverse=True) and bounces[-1] > 0
        assert len(set(bounces)) == len(bounces)


def test_kelvin_voigt_bounces_as_its_closed_solution_says():
    """m x'' + c x' + K x = 0 until the force vanishes: the speed there, in closed form."""
    K_I, damping = 1e4, 60.0
    decay = damping / 2
    wave = np.sqrt(K_I - decay**2)
    # F = K x + c x' = -x'' vanishes first at tan(wave t) = 2 decay wave / (decay^2 - wave^2).
    t = np.arctan2(2 * decay * wave, decay**2 - wave**2) / wave
    speed = np.exp(-decay * t) * (np.cos(wave * t) - decay / wave * np.sin(wave * t))
    found = restitution(KelvinVoigt(K_I=K_I, damping=damping), 1.0)
    assert found == pytest.approx(-speed, rel=1e-4)


def test_wrong_contacts_are_refused_by_field_and_value():
    for make, wrong in (
        (LinearSpring, {"K_I": 0.0}),
        (KelvinVoigt, {"damping": -1.0}),
        (HuntCrossley, {"exponent": 0.5}),
        (HuntCrossley, {"dissipation": float("nan")}),
    ):
        name, value = next(iter(wrong.items()))
        with pytest.raises(InvalidParameters, match=f"{name} = {value}"):
            make(**wrong)
