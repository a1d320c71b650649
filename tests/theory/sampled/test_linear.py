"""The linear map over a sample against the functions that it is derived from."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from alight.control import AdaptiveState
from alight.errors import AlightError
from alight.models import MassSpring
from alight.testbed import Motors, Testbed
from alight.theory import linearise
from alight.theory.lyapunov import errors_at, ideal_measurement
from alight.theory.sampled import linear_loop, rest_in_contact, rest_in_free_motion
from tests.control.cases import EXPERIMENT_1, PLANT, STABLE, changed, told
from tests.theory.sampled.rests import LOOPS, PHASES, RUBBING, T, law_for, subject

EVERY = pytest.mark.parametrize("phase", PHASES)
NAMED = pytest.mark.parametrize("name", LOOPS)
FLAT = [name for name in LOOPS if name != "upright"]


# Rest


@EVERY
@NAMED
def test_nothing_moves_at_rest(name, phase):
    rest = subject(name, phase).linear.rest
    moving = rest.plant.rates(rest.s, rest.tau, rest.pressing)
    for rate in (moving.q_dot, moving.x_m_dot):
        np.testing.assert_allclose(rate, 0.0, atol=1e-9)
    learning = AdaptiveState(**rest.law.flow(rest.a._asdict(), ideal_measurement(rest.s)).rates)
    assert abs(learning.u_f) < 1e-12 and abs(learning.theta_dk_hat) < 1e-15
    size = np.abs(rest.a.theta_r_hat) * np.sqrt(1e-3)
    assert np.abs(learning.theta_r_hat / size).max() < 1e-9


@NAMED
def test_only_contact_holds_the_force_of_the_spring(name):
    contact, free = (subject(name, phase).linear.rest for phase in ("contact", "free motion"))
    plant = contact.plant
    held = plant.body.k_s * (contact.s.x_m - plant.body.x_0)
    gap = plant.arm.x_r(contact.s.q)[0] - contact.s.x_m
    assert plant.contact.force(gap, 0.0, 1.0) == pytest.approx(held, rel=1e-9)
    load = np.linalg.solve(plant.arm.J(contact.s.q).T, contact.tau - plant.arm.h(contact.s.q))
    np.testing.assert_allclose(load, [held, 0.0], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(free.tau, plant.arm.h(free.s.q), atol=1e-9)
    assert plant.arm.x_r(free.s.q)[0] > free.s.x_m == plant.body.x_0


# One sample


@pytest.mark.parametrize("delay", [False, True])
@EVERY
@NAMED
def test_one_sample_agrees_with_the_true_one_to_second_order(name, phase, delay):
    loop = subject(name, phase)
    held = loop.linear.rest.tau if delay else []
    at = np.concatenate([loop.at, held])
    scale = np.concatenate([loop.scale, [1e-2] * len(held)])
    M = np.eye(len(at)) + T * loop.linear.slope(T, delay)
    origin = loop.step(at, delay)
    np.testing.assert_allclose((origin - at) / scale, 0.0, atol=1e-7)
    direction = scale * np.random.default_rng(len(name)).uniform(-1, 1, len(at))
    linear = M @ direction
    errors = []
    for share in (1.0, 0.5):
        moved = loop.step(at + share * direction, delay) - origin
        errors.append(np.abs((moved - share * linear) / scale).max())
    assert errors[0] < 0.05 * np.abs(linear / scale).max()
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.15)


def test_the_sample_time_is_an_input_and_the_delay_two_states():
    loop = subject("lossless", "contact").linear
    plain, delayed = loop.slope(1e-3, False), loop.slope(1e-3, True)
    assert plain.shape == (21, 21) and delayed.shape == (23, 23)
    assert not np.allclose(plain, loop.slope(2e-3, False))


# What does not take part


@EVERY
@NAMED
def test_unexcited_estimates_stay_and_act_on_nothing(name, phase):
    loop = subject(name, phase).linear
    n = loop.basis.shape[0]
    expected = 2 if phase == "contact" or name == "upright" else 0
    assert loop.unexcited == n - expected
    np.testing.assert_allclose(loop.dual @ loop.basis, np.eye(expected), atol=1e-12)
    weight = np.sqrt(np.array(loop.rest.law.Gamma_r))
    rest_of_space = np.linalg.svd((loop.basis / weight[:, None]).T)[2][expected:].T
    moved = loop.slope(T, False)[:, -n:] @ (weight[:, None] * rest_of_space)
    moved[-n:] /= weight[:, None]
    excited = np.abs(loop.slope(T, False)[:, -n:] * weight).max()
    assert np.abs(moved).max() < 1e-9 * (1 + excited)


@EVERY
@NAMED
def test_eigenvalues_of_the_whole_are_those_judged_and_those_left_out(name, phase):
    loop = subject(name, phase).linear
    whole = np.linalg.eigvals(loop.slope(T, False))
    left = list(np.linalg.eigvals(loop.judged(T, False))) + [0.0] * loop.unexcited
    if phase == "free motion":
        left += [*np.linalg.eigvals(loop.free_mass(T)), -1 / T, 0.0]  # x_m before, theta_dk_hat
    assert len(left) == len(whole)
    for root in left:
        assert np.abs(whole - root).min() < 1e-6 / T


@NAMED
def test_in_free_motion_nothing_acts_on_the_mass(name):
    loop = subject(name, "free motion").linear
    slope = loop.slope(T, True)
    mass = [loop.columns.index(n) for n in ("x_m", "x_m_dot", "v_x_m")]
    others = [i for i in range(len(slope)) if i not in mass]
    assert np.abs(slope[np.ix_(mass, others)]).max() == 0
    assert np.abs(slope[np.ix_(others, mass)]).max() > 0  # while it drives filter and arm
    theta_dk = loop.columns.index("theta_dk_hat")
    assert np.abs(slope[:, theta_dk]).max() < 1e-12 / T


@pytest.mark.parametrize("name", FLAT)
def test_in_free_motion_at_rest_nothing_excites_theta_r(name):
    rest = subject(name, "free motion").linear.rest
    Y_r = rest.law.Y_r(ideal_measurement(rest.s), errors_at(rest.law, rest.s, rest.a))
    assert np.abs(Y_r * rest.a.theta_r_hat).max() < 1e-9


def test_the_free_mass_without_losses_keeps_its_energy():
    loop = subject("lossless", "free motion").linear
    z = 1 + T * np.linalg.eigvals(loop.free_mass(T))
    omega = np.sqrt(PLANT.body.k_s / PLANT.body.m)
    expected = np.exp([1j * omega * T, -1j * omega * T])
    np.testing.assert_allclose(sorted(z, key=np.imag), sorted(expected, key=np.imag), atol=1e-14)


# As the sample time tends to zero


@pytest.mark.parametrize("name", FLAT[:4])
def test_short_samples_tend_to_the_continuous_loop(name):
    loop = subject(name, "contact").linear
    continuous = linearise(loop.rest.plant, law_for(name), "-").eigenvalues
    errors = []
    for short in (4e-6, 2e-6):
        found = 1 + short * np.linalg.eigvals(loop.judged(short, False))
        slow = np.log(found[np.abs(found) > 0.5]) / short
        assert len(slow) == 10  # all but the three remembered readings
        errors.append([np.abs(continuous - s).min() / np.abs(s) for s in slow])
    coarse, fine = np.array(errors).max(axis=1)
    assert fine < 0.02
    assert coarse / fine == pytest.approx(2.0, rel=0.1)


# Refusals


def test_a_set_point_before_the_spring_has_no_rest_in_contact():
    law = told()
    body = MassSpring(PLANT.body.m, PLANT.body.k_s, x_0=0.25)
    with pytest.raises(AlightError, match=r"no rest in contact: .*x_md beyond plant.body.x_0"):
        rest_in_contact(dataclasses.replace(PLANT, body=body), law, "-")


@pytest.mark.parametrize("name", ["theta_dk", "theta_r"])
def test_true_parameters_outside_the_bounds_have_no_rest(name):
    law = told()
    box = getattr(law, name)
    low = box.lower if isinstance(box.lower, tuple) else (box.lower,)
    tight = tuple(1.1 * v for v in low)
    values = tight if isinstance(box.lower, tuple) else tight[0]
    upper = tuple(1.05 * v for v in tight) if isinstance(box.lower, tuple) else 1.05 * values
    narrow = dataclasses.replace(box, initial=values, lower=values, upper=upper)
    with pytest.raises(AlightError, match=rf"outside the bounds of law.{name}"):
        rest_in_contact(PLANT, dataclasses.replace(law, **{name: narrow}), "-")


def test_a_filter_that_escapes_has_no_rest_in_free_motion():
    law = changed(told(gains=EXPERIMENT_1), alpha1=600.0)
    with pytest.raises(AlightError, match="no rest in free motion: the filter state reaches 1"):
        rest_in_free_motion(PLANT, law, "-")


def test_motors_too_weak_for_the_rest_are_refused():
    weak = Testbed(motors=Motors(limit=(1.0, 1.0)))
    with pytest.raises(AlightError, match=r"no rest in contact: it needs .* testbed.motors clips"):
        linear_loop(rest_in_contact(PLANT, told(gains=STABLE), "-"), weak)


def test_friction_of_the_joints_takes_part():
    rubbing = dataclasses.replace(PLANT, arm=RUBBING)
    loops = (
        linear_loop(rest_in_contact(plant, told(), "-"), Testbed()) for plant in (PLANT, rubbing)
    )
    smooth, rough = (np.trace(loop.plant(1e-6)[0]) for loop in loops)
    assert rough < smooth - 1
