"""The testbed in the closed loop: seeded noise, delay, hold, and what a law may know."""

from __future__ import annotations

import sys

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import alight
from alight.control import Measurement
from alight.models import PlantState
from alight.simulation.closed_loop import PLANT, ClosedLoop, advance
from alight.symbolic.build import build
from alight.symbolic.signals import Layout
from alight.testbed import Encoder, Motors, Probe, Testbed, Transducer
from tests.testbed.laws import PLANT_UNDER_TEST, START, PlainShaking, Shaking, each_way, ran

LAWS = pytest.mark.parametrize("law", [Shaking(), PlainShaking()], ids=["symbolic", "plain"])


NOISY = {"transducer": Transducer(resolution=1e-7, noise=1e-5)}


# What a law may know


def test_a_measurement_holds_positions_and_velocities_and_nothing_else():  # Assumption 3
    assert Measurement._fields == ("q", "q_dot", "x_m", "x_m_dot")
    assert Layout.of(Measurement).units == ("rad", "rad", "rad/s", "rad/s", "m", "m/s")


@LAWS
def test_the_probe_is_recorded_and_steers_nothing(law):
    near, far = (ran(law, probe=Probe(clearance=c)) for c in (1e-3, 2e-3))
    deflection = np.maximum(near["gap"], 0.0)
    assert deflection.max() > 1e-3  # the plate of the nearer probe is touched
    for recording, clearance in ((near, 1e-3), (far, 2e-3)):
        np.testing.assert_array_equal(recording["probe_clearance"], clearance - deflection)
    for name in near.layout.signals:
        if name != "probe_clearance":
            np.testing.assert_array_equal(near[name], far[name], err_msg=name)


# Noise


@pytest.mark.parametrize("law", [None, PlainShaking], ids=["the scenario's law", "plain"])
def test_the_same_seed_gives_the_same_run_bit_by_bit_and_another_another(law):
    scenario = alight.load_scenario(
        "experiment-1",
        {"duration": 0.15, "steady_state": 0.05, "testbed.transducer.noise": 1e-6},
    )
    first, again, other = (
        alight.simulate(scenario, law=law, seed=seed, backend="vm") for seed in (7, 7, 8)
    )
    np.testing.assert_array_equal(first.samples, again.samples)
    assert (first["x_m_measured"] != other["x_m_measured"]).any()


def test_the_noise_of_the_transducer_has_the_stated_deviation_and_no_bias():
    recording = ran(Shaking(), duration=1.0, transducer=Transducer(noise=1e-4))
    noise = recording["x_m_measured"] - recording["x_m"]
    n = len(noise)
    assert abs(noise.mean()) < 4e-4 / np.sqrt(n)
    assert noise.std() == pytest.approx(1e-4, rel=4 / np.sqrt(2 * n))


@each_way(Shaking(), PlainShaking())
@pytest.mark.parametrize("block", [1, 100, 256, 257])
def test_the_noise_does_not_depend_on_how_a_run_is_cut_into_blocks(
    monkeypatch, law, backend, block
):
    whole = ran(law, 0.15, backend=backend, **NOISY)
    monkeypatch.setattr(sys.modules["alight.simulation.run"], "BLOCK", block)
    cut = ran(law, 0.15, backend=backend, **NOISY)
    assert len(cut) == 300
    np.testing.assert_array_equal(cut.samples, whole.samples)


@LAWS
def test_a_longer_run_begins_as_the_shorter_one(law):
    shorter, longer = (ran(law, seconds, **NOISY) for seconds in (0.9, 1.2))
    assert len(longer) > 2048 > len(shorter)  # ticks in a block
    np.testing.assert_array_equal(longer.samples[: len(shorter)], shorter.samples)


# Sampling, delay, hold


@LAWS
def test_without_delay_the_clipped_torque_acts_at_once(law):
    recording = ran(law, **NOISY)
    tau, applied = recording["tau"], recording["tau_applied"]
    np.testing.assert_array_equal(applied, Motors().clip(tau))
    assert (np.abs(tau[:, 1]) > 20.0).any()


@LAWS
def test_the_delay_holds_the_clipped_torque_back_by_exactly_one_sample(law):
    recording = ran(law, delay=True, **NOISY)
    tau, applied = recording["tau"], recording["tau_applied"]
    assert not applied[0].any()
    np.testing.assert_array_equal(applied[1:], Motors().clip(tau)[:-1])
    assert (applied[1:] != Motors().clip(tau)[1:]).any()


@LAWS
def test_the_artificial_limit_acts_in_the_loop(law):
    recording = ran(law, motors=Motors(artificial_limit=(10.0, 5.0)))
    assert recording.peak("tau_applied").tolist() == [10.0, 5.0]
    assert (recording.peak("tau") > [10.0, 5.0]).all()


def test_law_on_expressions_and_law_in_plain_python_run_alike():
    recording, reference = ran(PlainShaking(), **NOISY), ran(Shaking(), **NOISY)
    assert recording.columns == reference.columns
    for name in reference.columns:
        rounding = 1e-9 * reference.peak(name) + 1e-15
        np.testing.assert_allclose(
            recording[name], reference[name], rtol=0, atol=rounding, err_msg=name
        )


@LAWS
def test_the_first_velocities_are_those_of_the_start(law):
    """The sensors have seen the sample before the first, so that no velocity spike starts a run."""
    recording = ran(law, encoder=Encoder(counts=0.0))
    np.testing.assert_allclose(recording["q_dot_measured"][0], START.q_dot, rtol=1e-10)
    assert recording["x_m_dot_measured"][0] == pytest.approx(START.x_m_dot, rel=1e-10)


def test_readings_are_those_of_the_present_state_and_differences_look_backwards():
    recording = ran(Shaking(), **NOISY)
    read = Encoder().read(recording["q"])
    np.testing.assert_array_equal(recording["q_measured"], read)
    np.testing.assert_array_equal(recording["q_dot_measured"][1:], np.diff(read, axis=0) * 2000.0)
    x_m = recording["x_m_measured"]
    np.testing.assert_array_equal(recording["x_m_dot_measured"][1:], np.diff(x_m) * 2000.0)


def test_the_torque_is_held_over_a_sample_and_the_substeps_converge_with_order_5():
    """Free motion over one slow sample, against a tight integration under a constant torque."""
    slow = Testbed(sample_rate=40.0)
    s = PlantState(np.array(START.q), np.array([-2.0, 3.0]), 0.5, 0.1, 0.0)
    tau, start = np.array([5.0, -1.0]), PLANT.pack(s._asdict())
    column = ca.SX.sym("column", PLANT.size)
    symbolic = PlantState(**PLANT.unpack(column))

    def sample_later(substeps: int) -> np.ndarray:
        following = advance(ClosedLoop(PLANT_UNDER_TEST, slow, Shaking(), substeps), symbolic, tau)
        outputs = {"following": PLANT.pack(following._asdict())}
        return build("sample", {"column": column}, outputs)(start).full()[:, 0]

    rates = build(
        "rates",
        {"column": column},
        {"rates": PLANT.pack(PLANT_UNDER_TEST.rates(symbolic, tau)._asdict())},
    )
    reference = solve_ivp(
        lambda t, x: rates(x).full()[:, 0], (0.0, 0.025), start, "DOP853", rtol=1e-13, atol=1e-13
    ).y[:, -1]
    errors = [np.linalg.norm(sample_later(n) - reference) for n in (4, 8, 16)]
    np.testing.assert_allclose(np.log2(np.divide(errors[:-1], errors[1:])), 5.0, atol=0.3)
