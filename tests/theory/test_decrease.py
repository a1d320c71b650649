"""V_r decreases along tightly integrated runs, for random plants, gains and starts.

The runs are short and their gains moderate, so that the continuous loop is resolved; a run is cut
where the arm comes near a singular pose, in which ``M_bar`` has no bound and Remark 1 of the paper
no longer holds.
"""

from __future__ import annotations

import dataclasses
import functools
from typing import NamedTuple

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import cumulative_simpson

import alight
from alight.control import AdaptiveState, Estimate, ForceLimiting, Gains
from alight.models import LinearSpring, MassSpring, Plant
from alight.simulation.closed_loop import ClosedLoop, InitialState
from alight.simulation.continuous import continuous_rates, split_state
from alight.symbolic.build import build
from alight.symbolic.derive import time_derivative
from alight.symbolic.ops import as_vector, dot, tanh
from alight.theory import V_r, linearise
from tests.control.cases import EXPERIMENT_1, PLANT, told, true_theta_r
from tests.theory.runs import SINGULAR, STRONG, log_uniform

SEEDS = range(10)
MORE_SEEDS = [seed for seed in range(10, 70) if seed != 64]
"""Seed 64 drives the arm into the pose ``q2 = 0``, before which the solver's steps tend to zero."""


class Run(NamedTuple):
    """One continuous run."""

    t: np.ndarray
    V_r: np.ndarray
    rate: np.ndarray
    """V_r_dot by differentiation along the closed loop."""
    dissipation: np.ndarray
    """``r^T k3 Tanh(r) + e_r^T alpha Tanh(e_r)``."""
    inside: bool
    """Whether every estimate stayed between its bounds, so that no projection acted."""
    switches: int
    touched: bool
    e_m: np.ndarray


def random_law(rng: np.random.Generator) -> ForceLimiting:
    def pair(low: float, high: float) -> tuple[float, float]:
        first, second = log_uniform(rng, low, high, 2)
        return float(first), float(second)

    gains = Gains(
        k1=log_uniform(rng, 0.3, 3.0),
        k2=log_uniform(rng, 0.2, 2.0),
        k3=pair(5.0, 150.0),
        alpha1=log_uniform(rng, 3.0, 60.0),
        alpha2=log_uniform(rng, 5.0, 60.0),
        alpha3=log_uniform(rng, 0.1, 3.0),
        alpha=pair(5.0, 60.0),
        Gamma=log_uniform(rng, 0.1, 3.0),
    )
    body = MassSpring(log_uniform(rng, 0.5, 4.0), log_uniform(rng, 200.0, 1500.0), x_0=0.206)
    spring = LinearSpring(K_I=log_uniform(rng, 5e3, 5e4))
    plant = dataclasses.replace(PLANT, body=body, contact=spring)
    theta_r = true_theta_r(plant)
    low, high = rng.uniform(0.3, 0.8, 10) * theta_r, rng.uniform(1.2, 3.0, 10) * theta_r
    initial = low + rng.uniform(0.0, 1.0, 10) * (high - low)
    return told(
        plant,
        gains,
        Gamma_r=tuple(log_uniform(rng, 1e-4, 1e-1, 10) * theta_r**2),
        theta_r=Estimate(tuple(initial), tuple(low), tuple(high)),
    )


def random_start(rng: np.random.Generator, plant: Plant) -> InitialState:
    """Before the body, close to it, or pressed on it; moving, either elbow."""
    gap = rng.choice([-0.05, -0.005, 0.002])
    q = plant.arm.inverse((plant.body.x_0 + gap, 0.4), rng.choice(["+", "-"]))
    q_dot = rng.uniform(-1.0, 1.0, 2)
    return InitialState(
        q=(float(q[0]), float(q[1])),
        x_m=plant.body.x_0,
        q_dot=(float(q_dot[0]), float(q_dot[1])),
        x_m_dot=float(rng.uniform(-0.3, 0.3)),
    )


def watch(law: ForceLimiting, size: int) -> ca.Function:
    """V_r, its rate along the loop, and what it must at least fall by."""
    column = ca.SX.sym("x", size)
    rates, seen = continuous_rates(law.model, law, column)

    def value(x: ca.SX) -> ca.SX:
        s, memory = split_state(law, x)
        return V_r(law.model, law, s, AdaptiveState(**memory))

    e_r, r_r, g = seen["e_r"], seen["r_r"], law.gains
    falls = dot(r_r, as_vector(g.k3) * tanh(r_r)) + dot(e_r, as_vector(g.alpha) * tanh(e_r))
    return build(
        "watch",
        {"x": column},
        {"V_r": value(column), "rate": time_derivative(value, [column], [rates]), "falls": falls},
    )


def follow(law: ForceLimiting, start: InitialState, end: float = 0.5) -> Run:
    times = np.linspace(0.0, end, 1001)
    run = alight.reference(ClosedLoop(law.model, STRONG, law), start, times, rtol=1e-10, atol=1e-12)
    recording = run.recording
    poses = np.abs(recording["det_J"]) > SINGULAR
    kept = len(poses) if poses.all() else int(np.argmin(poses))
    parts = ("q", "q_dot", "x_m", "x_m_dot", "z", "u_f", "theta_dk_hat", "theta_r_hat")
    states = np.hstack([recording[name].reshape(len(poses), -1) for name in parts])[:kept]
    watched = watch(law, states.shape[1])
    value, rate, falls = (np.asarray(v).ravel() for v in watched.map(kept)(states.T))
    hats = recording["theta_r_hat"][:kept]
    inside = (hats >= law.theta_r.lower) & (hats <= law.theta_r.upper)
    return Run(
        recording.t[:kept],
        value,
        rate,
        falls,
        bool(inside.all()),
        int((run.switches <= recording.t[kept - 1]).sum()),
        bool(recording["Lambda"][:kept].any()),
        recording["e_m"][:kept],
    )


@functools.cache
def random_run(seed: int) -> Run:
    rng = np.random.default_rng(seed)
    law = random_law(rng)
    return follow(law, random_start(rng, law.model))


def assert_decreases(run: Run) -> None:
    bound = 1e-9 * (np.abs(run.rate) + run.dissipation)
    assert (run.rate <= -run.dissipation + bound).all()
    integration_error = 1e-8 * run.V_r[0]  # hundred times what the solver keeps per step
    assert (np.diff(run.V_r) <= integration_error).all()
    assert run.V_r[-1] < run.V_r[0]


def assert_falls_by_its_dissipation(run: Run) -> None:
    fallen = run.V_r[0] - run.V_r
    owed = cumulative_simpson(run.dissipation, x=run.t, initial=0.0)
    slack = 1e-4 * owed[-1] + 1e-8 * run.V_r[0]  # Simpson's rule across a kink
    assert (fallen >= owed - slack).all()
    if run.inside:
        np.testing.assert_allclose(fallen, owed, rtol=0, atol=slack)


@pytest.mark.parametrize("seed", SEEDS)
def test_V_r_never_rises(seed):
    assert_decreases(random_run(seed))


@pytest.mark.parametrize("seed", SEEDS)
def test_V_r_falls_by_the_integral_of_the_feedback_and_more_only_by_projection(seed):
    assert_falls_by_its_dissipation(random_run(seed))


def test_the_runs_cover_free_motion_contact_switching_and_projection():
    runs = [random_run(seed) for seed in SEEDS]
    assert sum(run.switches >= 2 for run in runs) >= 3
    assert any(run.touched for run in runs) and any(not run.touched for run in runs)
    assert {run.inside for run in runs} == {True, False}
    assert sum(len(run.t) > 500 for run in runs) >= 8


@pytest.mark.slow
@pytest.mark.parametrize("seed", MORE_SEEDS)
def test_V_r_never_rises_in_many_more_runs(seed):
    run = random_run(seed)
    assert_decreases(run)
    assert_falls_by_its_dissipation(run)


def test_V_r_falls_also_where_the_loop_is_unstable():
    """The printed gains (42): the mass swings up (condition LOC), the robot part still decays."""
    theta_r = true_theta_r(PLANT)
    law = told(
        gains=EXPERIMENT_1,
        theta_dk=Estimate(PLANT.theta_dk, PLANT.theta_dk / 2, 2 * PLANT.theta_dk),
        theta_r=Estimate(tuple(theta_r), tuple(theta_r / 2), tuple(2 * theta_r)),
    )
    equilibrium = linearise(PLANT, law, "-").state
    q, x_m = equilibrium[:2], equilibrium[4]
    start = InitialState(q=(float(q[0]), float(q[1])), x_m=float(x_m) + 1e-4)
    run = follow(law, start)
    assert_decreases(run)
    early, late = (np.abs(run.e_m[part]).max() for part in (slice(0, 200), slice(-200, None)))
    assert late > 2 * early
