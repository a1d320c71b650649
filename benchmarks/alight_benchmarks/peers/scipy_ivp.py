"""SciPy's LSODA on the continuous closed loop.

The projection makes the loop stiff: RK45 needs a hundred thousand steps for the first 60 ms, and
BDF and Radau take ten times as long as LSODA, so that no user would stay with them. The tolerance
gives the accuracy of four Runge-Kutta steps in a sample.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from alight_benchmarks.equations import closed_loop_rates, initial_law_state, with_arrays
from alight_benchmarks.generated import compiled, rates_of, slopes_of
from alight_benchmarks.peer import Peer, Problem, Run

RTOL, ATOL = 1e-5, 1e-8


Rates = Callable[[float, np.ndarray], np.ndarray]


def initial_state(problem: Problem) -> np.ndarray:
    """Six states of the plant, the filter, and the estimates, at the start."""
    n = problem.numbers
    return np.hstack([*n.q0, 0.0, 0.0, n.x_m0, 0.0, *initial_law_state(n, np)])


def numpy_rates(problem: Problem) -> Rates:
    """Right-hand side in NumPy."""
    n = with_arrays(problem.numbers, np)

    def rates(_: float, x: np.ndarray) -> np.ndarray:
        plant, law = closed_loop_rates(np, n, x)
        return np.hstack([*plant, *law])

    return rates


def compiled_rates(problem: Problem) -> Rates:
    """Right-hand side as C that CasADi generates from Alight's expressions."""
    rates = compiled(rates_of(problem.scenario))
    return lambda _, x: rates(x)[0]


def compiled_slopes(problem: Problem) -> Rates:
    """Jacobian of the right-hand side, likewise."""
    slopes = compiled(slopes_of(rates_of(problem.scenario)))
    return lambda _, x: slopes(x)[0].reshape((len(x), len(x)), order="F")


def _run(problem: Problem, rates: Rates, **options: Any) -> Run:
    from scipy.integrate import solve_ivp

    x = initial_state(problem)
    options |= {"method": "LSODA", "rtol": RTOL, "atol": ATOL, "t_eval": problem.times}

    def run() -> np.ndarray:
        return solve_ivp(rates, (0.0, problem.duration), x, **options).y[[0, 1, 4]].T

    return run


def _prepare_numpy(problem: Problem) -> Run:
    return _run(problem, numpy_rates(problem))


def _prepare_compiled(problem: Problem) -> Run:
    return _run(problem, compiled_rates(problem), jac=compiled_slopes(problem))


PEERS = (
    Peer(
        name="SciPy LSODA, NumPy",
        package="scipy",
        how=f"continuous loop by solve_ivp (LSODA, rtol {RTOL:g}), right-hand side in NumPy",
        prepare=_prepare_numpy,
        continuous=True,
        tolerance=1e-4,
    ),
    Peer(
        name="SciPy LSODA, C",
        package="scipy",
        how="the same, right-hand side and Jacobian as C that CasADi generates",
        prepare=_prepare_compiled,
        continuous=True,
        tolerance=1e-4,
    ),
)
