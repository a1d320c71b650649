"""Euler steps of the estimates: the tolerance of the projection, and what runs need of it."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import alight
from alight.control import Estimate, Measurement
from alight.theory.lyapunov import dissipation
from alight.theory.sampled import adaptation_steps
from tests.strategies import between, log_between


def box(margin: float, order: int = 1, leak: float = 1e-3) -> Estimate:
    """Bounds -1 and 1."""
    return Estimate(0.0, -1.0, 1.0, margin=margin, leak=leak, order=order)


def stepped(estimate: Estimate, theta: float, change: float, T: float = 1.0) -> float:
    """An Euler step at the rate ``change / T`` before projection."""
    return theta + T * float(estimate.project(change / T, theta))


@given(
    log_between(1e-3, 1.0),
    st.integers(1, 6),
    between(-1.0, 1.0),
    between(-1.0, 1.0),
    log_between(1e-6, 1e-1),
)
def test_a_step_within_the_tolerance_stays_in_the_widened_bounds(margin, order, where, share, leak):
    estimate = box(margin, order, leak)
    theta = where * (1 + margin)
    after = stepped(estimate, theta, share * margin / (order + 1))
    assert abs(after) <= (1 + margin) * (1 + 1e-12)


@given(log_between(1e-3, 1.0), st.integers(1, 6), between(0.0, 1.0), st.sampled_from([-1.0, 1.0]))
def test_so_does_the_longest_such_step_from_anywhere_in_the_layer(margin, order, depth, side):
    theta = side * (1 + margin * depth)
    after = stepped(box(margin, order), theta, side * margin / (order + 1))
    assert abs(after) <= (1 + margin) * (1 + 1e-12)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_beyond_the_tolerance_a_thin_layer_is_left(order):
    thin = box(1e-4, order, leak=1e-12)
    theta = 1 + 1e-4 * np.linspace(0.0, 1.0, 1001)
    after = [stepped(thin, float(t), 1.05 * 1e-4 / (order + 1)) for t in theta]
    assert max(after) > 1 + 1e-4


@given(between(-1.0, 1.0), between(-1.0, 1.0), log_between(1e-3, 1e3))
def test_the_clip_takes_an_estimate_no_farther_from_a_truth_within_the_bounds(truth, where, size):
    estimate = box(0.1)
    wild = where * size
    assert abs(estimate.clip(wild) - truth) <= abs(wild - truth)


@pytest.fixture(scope="module")
def ran():
    scenario = alight.load_scenario("experiment-1", {"duration": 0.5, "steady_state": 0.1})
    return scenario, alight.simulate(scenario, backend="vm")


def test_steps_along_a_run_are_those_of_the_equations(ran):
    scenario, recording = ran
    law, T = scenario.law, 1 / scenario.testbed.sample_rate
    few = dataclasses.replace(recording, t=recording.t[::50], samples=recording.samples[::50])
    found = adaptation_steps(law, few, T)
    ratios, outrun = [], []
    for i in range(len(few)):
        at = {name: few[f"{name}_measured"][i] for name in Measurement._fields}
        e = law.errors(Measurement(**at), few["u_f"][i], few["theta_dk_hat"][i])
        Y_r = law.Y_r(Measurement(**at), e)
        gain = np.array(law.Gamma_r)
        steps = [T * law.gains.Gamma * (at["x_m"] - law.model.body.x_0) * e.eta_m]
        steps += list(T * gain * (Y_r.T @ e.r_r))
        wide = [law.theta_dk.epsilon, *law.theta_r.epsilon]
        ratios.append(2 * np.abs(steps) / wide)
        euler = T * np.sum(gain * (Y_r.T @ e.r_r) ** 2)
        outrun.append(euler > 2 * dissipation(law, e))
    np.testing.assert_allclose(found.ratio, np.max(ratios, axis=0), rtol=1e-9)
    assert found.beyond == np.mean(np.any(np.array(ratios) > 1, axis=1))
    assert found.outrun == np.mean(outrun)
    assert found.columns[0] == "theta_dk_hat" and found.columns[10] == "theta_r_hat10"


def test_steps_grow_with_the_sample_time(ran):
    scenario, recording = ran
    fine, coarse = (adaptation_steps(scenario.law, recording, T) for T in (1e-4, 1e-3))
    np.testing.assert_allclose(coarse.ratio, 10 * fine.ratio)
    assert coarse.beyond >= fine.beyond and coarse.outrun >= fine.outrun


def test_what_stands_on_the_clip_is_counted(ran):
    scenario, recording = ran
    law = scenario.law
    low, high = law.theta_r.widened
    found = adaptation_steps(law, recording, 5e-4).clipped
    for i in range(10):
        values = recording["theta_r_hat"][:, i]
        ends = np.isclose(values, low[i], rtol=1e-12) | np.isclose(values, high[i], rtol=1e-12)
        assert found[1 + i] == np.mean(ends)
    assert found[0] == 0 < found[4] < 1


def test_adaptation_of_the_experiment_needs_the_clip_and_that_of_theta_dk_does_not(ran):
    scenario, recording = ran
    found = adaptation_steps(scenario.law, recording, 1 / scenario.testbed.sample_rate)
    assert found.ratio[0] < 1 < found.ratio[1:].max()
    assert 0 < found.outrun < 1
