"""The reference of the sampled loop: an adaptive solver between samples, switches located."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np
from scipy.integrate import solve_ivp

from alight.kernels.direct import Direct
from alight.simulation.closed_loop import PLANT, ClosedLoop, InitialState, phases_of, tick_program
from alight.simulation.ending import ending
from alight.simulation.recording import Recording
from alight.symbolic.build import build


def sampled_reference(
    loop: ClosedLoop,
    start: InitialState,
    duration: float,
    *,
    seed: int = 0,
    rtol: float = 1e-12,
    atol: float = 1e-14,
) -> Recording:
    """Run a closed loop as `run` does, with the plant integrated to tight tolerances.

    Sampling, sensors, noise and law are those of `run`; what differs is the error of its fixed
    steps, which this reference shows. It takes about a thousand times as long.

    Parameters
    ----------
    loop : ClosedLoop
        With a law that takes expressions; its ``substeps`` are not used.
    start : InitialState
        Joint angles [rad] and position of the mass [m] at the first sample.
    duration : float
        Length of the run [s].
    seed : int
        Seed of the sensor noise.
    rtol, atol : float
        Tolerances of DOP853.
    """
    zeros = loop.zeros()
    program = tick_program(loop, None, zeros)
    tick, plant = Direct(program.usual), _Interval(loop, rtol, atol)
    p, x = loop.parameter_values(zeros), loop.initial_column(start)
    noise = np.random.default_rng(seed).standard_normal(max(round(duration / loop.dt), 1))
    rows = []
    for w in noise:
        x_next, y, tau, _ = tick(x, w, p)
        rows.append(y)
        if y[-1]:
            x = x_next
            break
        x = np.concatenate([plant.advance(x[: PLANT.size], tau), x_next[PLANT.size :]])
    samples, t = np.array(rows), np.arange(len(rows)) * loop.dt
    verdict = ending(int(samples[-1, -1]), float(t[-1]), loop.law, x[: PLANT.size])
    return Recording(t, samples[:, :-1], program.recorded, verdict)


class _Interval:
    """Integrates the plant over a sample, from one switch of contact to the next."""

    def __init__(self, loop: ClosedLoop, rtol: float, atol: float) -> None:
        x, tau, phase = ca.SX.sym("x", PLANT.size), ca.SX.sym("tau", 2), ca.SX.sym("phase")
        phases = phases_of(loop.plant, tau)
        inputs = {"x": x, "tau": tau, "phase": phase}
        self._rates = Direct(build("rates", inputs, {"x_dot": phases.rates(x, phase)}))
        self._guard = Direct(build("guard", {"x": x}, {"guard": phases.guard(x)}))
        self._dt, self._options = loop.dt, {"method": "DOP853", "rtol": rtol, "atol": atol}

    def advance(self, x: np.ndarray, tau: np.ndarray) -> np.ndarray:
        """State of the plant one sample later."""
        t, presses = 0.0, float(self._guard(x)[0][0] >= 0)
        while t < self._dt:
            part = solve_ivp(
                lambda _, at, presses=presses: self._rates(at, tau, presses)[0],
                (t, self._dt),
                x,
                events=self._switch(presses),
                **self._options,
            )
            t, x, presses = float(part.t[-1]), part.y[:, -1], 1.0 - presses
        return x

    def _switch(self, presses: float) -> Any:
        def guard(_: float, x: np.ndarray) -> float:
            return float(self._guard(x)[0][0])

        # a phase begins on the surface to rounding: only the way back across it is an event
        guard.terminal, guard.direction = True, -1 if presses else 1  # type: ignore[attr-defined]
        return guard
