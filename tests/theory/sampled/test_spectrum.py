"""Eigenvalues against simulation, and the border of stability in the sample time."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
import pytest

import alight
from alight.kernels import runner
from alight.models import TipFriction
from alight.simulation import ClosedLoop, InitialState, Outcome, Recording, Verdict
from alight.simulation.closed_loop import tick_program
from alight.testbed import Encoder, Testbed, Transducer
from alight.theory.case import case_of
from alight.theory.sampled import (
    LinearLoop,
    growth,
    largest_sample_time,
    linear_loop,
    rest_in_contact,
    spectrum,
)
from tests.theory.sampled.rests import subject


@functools.cache
def experiment(name: str, losses: bool) -> LinearLoop:
    """Contact of an experiment without tip friction, with its other losses or without any."""
    scenario = alight.load_scenario(name)
    own = dataclasses.replace(scenario.plant, tip_friction=TipFriction())
    plant = own if losses else case_of(scenario).plant
    rest = rest_in_contact(plant, scenario.law, scenario.document.start.elbow)
    return linear_loop(rest, scenario.testbed)


def simulated(loop: LinearLoop, rate: float, delay: bool, samples: int) -> Recording:
    """A run with exact sensors from a hundredth of a micrometre beside the rest."""
    rest, law = loop.rest, loop.rest.law
    theta_dk = dataclasses.replace(law.theta_dk, initial=float(rest.a.theta_dk_hat))
    theta_r = dataclasses.replace(law.theta_r, initial=tuple(rest.a.theta_r_hat.tolist()))
    law = dataclasses.replace(law, theta_dk=theta_dk, theta_r=theta_r)
    bed = Testbed(rate, Encoder(counts=0.0), Transducer(), delay=delay)
    closed = ClosedLoop(rest.plant, bed, law, substeps=8)
    q1, q2 = rest.s.q.tolist()
    x = closed.initial_column(InitialState(q=(q1 + 1e-8, q2 - 2e-8), x_m=rest.s.x_m + 1e-8))
    if delay:
        x[-2:] = rest.tau  # a run starts with no torque held back, far from this rest
    program = tick_program(closed, None, closed.zeros())
    p = closed.parameter_values(closed.zeros())
    _, y = runner(program, "vm").run(x, np.zeros(samples), p)
    t = np.arange(len(y)) / rate
    return Recording(t, y[:, :-1], program.recorded, Verdict(Outcome.COMPLETED, float(t[-1])))


def deviations(loop: LinearLoop, recording: Recording, delay: bool) -> np.ndarray:
    """Distance from the rest in the coordinates of `LinearLoop.judged`, one row per sample."""
    rest = loop.rest
    parts = [recording["q"] - rest.s.q, recording["q_dot"], recording["x_m"] - rest.s.x_m]
    parts += [recording["x_m_dot"], recording["q_dot_measured"], recording["x_m_dot_measured"]]
    parts += [recording["u_f"], recording["theta_dk_hat"] - rest.a.theta_dk_hat]
    parts += [(recording["theta_r_hat"] - rest.a.theta_r_hat) @ loop.dual.T]
    parts += [recording["tau_applied"] - rest.tau] if delay else []
    return np.column_stack(parts)


def rates_of(loop: LinearLoop, rate: float, delay: bool, samples: int) -> tuple[float, float]:
    """Rate [1/s] of the least damped oscillation: as the eigenvalue has it, as a run shows it."""
    M = np.eye(15 if delay else 13) + loop.judged(1 / rate, delay) / rate
    z, left = np.linalg.eig(M.T)
    swinging = np.flatnonzero((z.imag > 0) & (np.abs(z) > 0.1))
    i = swinging[np.abs(z[swinging]).argmax()]
    recording = simulated(loop, rate, delay, samples)
    assert recording["gap"].min() > 0
    amplitude = np.abs(deviations(loop, recording, delay) @ left[:, i])
    k = np.arange(len(amplitude))
    slope = np.polyfit(k[5:], np.log(amplitude[5:]), 1)[0] * rate
    return float(np.log(np.abs(z[i])) * rate), float(slope)


@pytest.mark.parametrize(
    ("losses", "name", "rate", "grows"),
    [
        (False, "experiment-1", 2000.0, True),
        (True, "experiment-1", 2000.0, True),
        (True, "experiment-1", 3000.0, False),
        (True, "experiment-2", 3900.0, True),
        (True, "experiment-2", 4400.0, False),
        (False, "experiment-2", 15000.0, True),
        (False, "experiment-2", 16000.0, False),
    ],
)
def test_runs_grow_and_decay_at_the_rate_of_the_eigenvalue(losses, name, rate, grows):
    loop = experiment(name, losses)
    predicted, shown = rates_of(loop, rate, False, 150)
    assert shown == pytest.approx(predicted, rel=0.01, abs=0.02)
    assert (predicted > 0) == grows == (growth(loop, 1 / rate, False) > 0)


@pytest.mark.parametrize(("rate", "grows"), [(4500.0, True), (5500.0, False)])
def test_with_a_delay_of_one_sample_too(rate, grows):
    predicted, shown = rates_of(experiment("experiment-1", True), rate, True, 150)
    assert shown == pytest.approx(predicted, rel=0.01, abs=0.02)
    assert (predicted > 0) == grows


def test_the_linear_map_retraces_a_run():
    loop = experiment("experiment-1", True)
    found = deviations(loop, simulated(loop, 2000.0, False, 100), False)
    M = np.eye(13) + loop.judged(5e-4, False) * 5e-4
    x, size = found[0], np.abs(found).max(axis=0)
    for row in found[1:]:
        x = M @ x
        assert (np.abs(x - row) <= 2e-3 * size).all()


# The border


@pytest.mark.parametrize("delay", [False, True])
@pytest.mark.parametrize(
    ("name", "phase"),
    [("lossless", "contact"), ("with losses", "free motion"), ("upright", "free motion")],
)
def test_the_largest_sample_time_is_where_decay_ends(name, phase, delay):
    loop = subject(name, phase).linear
    largest, undefined = largest_sample_time(loop, delay)
    assert not undefined
    for share in np.geomspace(1e-2, 1 - 1e-6, 12):
        assert growth(loop, share * largest, delay) < 0
    assert growth(loop, (1 + 1e-6) * largest, delay) > 0
    assert spectrum(loop, largest, delay).radius == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("name", ["lossless", "with losses", "unsaturated"])
@pytest.mark.parametrize("phase", ["contact", "free motion"])
def test_a_delay_makes_it_smaller(name, phase):
    loop = subject(name, phase).linear
    plain, delayed = (largest_sample_time(loop, delay)[0] for delay in (False, True))
    assert delayed < plain


def test_a_loop_that_grows_without_sampling_has_none():
    largest, undefined = largest_sample_time(subject("(42)", "contact").linear, False)
    assert largest is None
    assert undefined.startswith("it grows at") and "however fast it is sampled" in undefined


# What is told of a spectrum


@pytest.mark.parametrize("phase", ["contact", "free motion"])
def test_growth_and_radius_are_one(phase):
    loop = subject("lossless", phase).linear
    for T in (1e-4, 1e-3, 1e-2):
        found = spectrum(loop, T, False)
        assert growth(loop, T, False) == pytest.approx(np.log(found.radius) / T, abs=1e-9 / T)


def test_the_least_damped_mode_is_that_of_the_continuous_loop():
    loop = subject("lossless", "contact").linear
    found = spectrum(loop, 1e-6, False)
    s = np.log(found.judged[np.abs(found.judged) > 0.5]) / 1e-6
    damping, frequency = found.least_damped
    assert damping == pytest.approx((-s.real / np.abs(s)).min())
    assert np.isclose(np.abs(s), frequency, rtol=1e-9).any()
    assert 0 < damping < 0.1


def test_of_modes_that_do_not_oscillate_the_slowest_is_told():
    found = dataclasses.replace(
        spectrum(subject("lossless", "contact").linear, 1e-3, False),
        judged=np.array([0.9, 0.99, 0.0]),
    )
    damping, frequency = found.least_damped
    assert damping == 1.0 and frequency == pytest.approx(-np.log(0.99) / 1e-3)
