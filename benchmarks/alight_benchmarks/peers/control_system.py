"""python-control: the continuous closed loop as a nonlinear system, and its response.

LSODA, as python-control's documentation advises: the loop is stiff, and RK45, its default, needs
more than 9 s for the first 2 s of the run even with a right-hand side in C.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from alight_benchmarks.peer import Peer, Problem, Run
from alight_benchmarks.peers.scipy_ivp import (
    ATOL,
    RTOL,
    Rates,
    compiled_rates,
    compiled_slopes,
    initial_state,
    numpy_rates,
)


def _response(problem: Problem, rates: Rates, **options: Any) -> Run:
    import control

    start = initial_state(problem)
    loop = control.nlsys(
        lambda t, x, u, params: rates(t, x),
        lambda t, x, u, params: x[[0, 1, 4]],
        states=len(start),
        inputs=0,
        outputs=["q1", "q2", "x_m"],
    )

    def run() -> np.ndarray:
        response = control.input_output_response(
            loop,
            [0.0, problem.duration],
            initial_state=start,
            evaluation_times=problem.times,
            solve_ivp_method="LSODA",
            solve_ivp_kwargs={"rtol": RTOL, "atol": ATOL, **options},
        )
        return response.outputs.T

    return run


def _prepare_numpy(problem: Problem) -> Run:
    return _response(problem, numpy_rates(problem))


def _prepare_compiled(problem: Problem) -> Run:
    return _response(problem, compiled_rates(problem), jac=compiled_slopes(problem))


PEERS = (
    Peer(
        name="python-control, NumPy",
        package="control",
        how=f"continuous loop by input_output_response (LSODA, rtol {RTOL:g}), "
        "right-hand side in NumPy",
        prepare=_prepare_numpy,
        continuous=True,
        tolerance=1e-4,
    ),
    Peer(
        name="python-control, C",
        package="control",
        how="the same, right-hand side and Jacobian as C that CasADi generates",
        prepare=_prepare_compiled,
        continuous=True,
        tolerance=1e-4,
    ),
)
