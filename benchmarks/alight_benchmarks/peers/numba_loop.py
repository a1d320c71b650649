"""Numba: the loop written by hand."""

from __future__ import annotations

from collections import namedtuple

import numpy as np

from alight_benchmarks.peer import RECORD_EVERY, Numbers, Peer, Problem, Run


def _scalars(n: Numbers) -> dict[str, float]:
    """The scalar numbers, those of pairs one by one."""
    names = ("l1", "l2", "p1", "p2", "p3", "m", "k_s", "x_0", "K_I", "x_md", "x_rd2")
    gains = ("k1", "k2", "alpha1", "alpha2", "alpha3", "Gamma")
    pairs = {"k3": n.k3, "alpha": n.alpha, "limit": n.tau_max}
    return {
        **{name: float(getattr(n, name)) for name in names + gains},
        **{f"{name}_{i + 1}": float(pair[i]) for name, pair in pairs.items() for i in range(2)},
        "dk_lower": n.theta_dk.lower,
        "dk_upper": n.theta_dk.upper,
        "margin": n.theta_dk.margin,
        "leak": n.theta_dk.leak,
    }


def _prepare(problem: Problem) -> Run:
    from alight_benchmarks import numba_kernel

    n, box = problem.numbers, problem.numbers.theta_r
    scalars = _scalars(n)
    constants = namedtuple("Constants", scalars)(**scalars)
    start = np.array([*n.q0, 0.0, 0.0, n.x_m0, 0.0])
    memory = np.array([np.tanh(n.e_f0), n.theta_dk.initial])
    theta, *fixed = (np.array(v) for v in (box.initial, n.Gamma_r, box.lower, box.upper))

    def run(ticks: int = problem.ticks) -> np.ndarray:
        state = start.copy(), memory.copy(), theta.copy()
        rate, substeps = problem.sample_rate, problem.substeps
        return numba_kernel.closed_loop(
            constants, *state, *fixed, ticks, RECORD_EVERY, rate, substeps
        )

    run(1)
    return run


PEERS = (
    Peer(
        name="Numba",
        package="numba",
        how="the sampled loop by hand in scalar Python, all of it compiled",
        prepare=_prepare,
    ),
)
