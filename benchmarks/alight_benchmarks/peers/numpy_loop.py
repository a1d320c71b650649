"""A Python loop over NumPy: the straightforward way, and a batch of runs as arrays."""

from __future__ import annotations

from typing import Any

import numpy as np

from alight_benchmarks.equations import (
    Measured,
    clip_torque,
    initial_law_state,
    law_flow,
    law_step,
    plant_rates,
    rk4,
    with_arrays,
)
from alight_benchmarks.peer import RECORD_EVERY, Numbers, Peer, Problem, Run, varied

BATCH = 2048
"""Runs at which Python's share is hardly felt; larger batches gain a few per cent."""


def step_plant(problem: Problem, n: Numbers, x: np.ndarray, tau: Any) -> np.ndarray:
    """State of the plant one sample later."""

    def rates(x: np.ndarray) -> np.ndarray:
        return np.array(plant_rates(np, n, x, *tau))

    for _ in range(problem.substeps):
        x = rk4(rates, x, 1 / (problem.sample_rate * problem.substeps))
    return x


def sampled_loop(problem: Problem, n: Numbers, shape: tuple[int, ...] = ()) -> np.ndarray:
    """Run the sampled loop once, or as a batch of the given shape; the rows that are kept."""
    dt = 1 / problem.sample_rate
    x = np.stack([np.full(shape, v) for v in (*n.q0, 0.0, 0.0, n.x_m0, 0.0)])
    before, law = x, initial_law_state(n, np)
    rows = []
    for k in range(problem.ticks):
        if k % RECORD_EVERY == 0:
            rows.append(x[[0, 1, 4]])
        q1_dot, q2_dot, _, _, x_m_dot, _ = (x - before) / dt
        before = x
        flow = law_flow(np, n, Measured(x[0], x[1], q1_dot, q2_dot, x[4], x_m_dot), law)
        law = law_step(np, n, law, flow.rates, dt)
        x = step_plant(problem, n, x, clip_torque(np, n, flow.tau1, flow.tau2))
    return np.array(rows)


def _prepare(problem: Problem) -> Run:
    n = with_arrays(problem.numbers, np)
    return lambda: sampled_loop(problem, n)


def _prepare_batch(problem: Problem) -> Run:
    n = with_arrays(varied(problem.numbers, BATCH), np, batched=True)
    return lambda: sampled_loop(problem, n, (BATCH,))[:, :, 0]


PEERS = (
    Peer(
        name="NumPy",
        package="numpy",
        how="sampled law and Runge-Kutta plant in a plain Python loop",
        prepare=_prepare,
    ),
    Peer(
        name="NumPy, batch",
        package="numpy",
        how="the same loop over arrays of runs",
        prepare=_prepare_batch,
        batch=BATCH,
    ),
)
