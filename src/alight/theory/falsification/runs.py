"""An attack on the time of first contact, Proposition C, by runs of the closed loop."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Iterator
from typing import Any

import casadi as ca
import numpy as np

from alight.simulation.continuous import continuous_rates, join_state
from alight.symbolic.build import build
from alight.symbolic.parameters import lift, values_of
from alight.theory.falsification.approach import RESTING
from alight.theory.falsification.claims import Claims
from alight.theory.falsification.hunt import Search
from alight.theory.falsification.judged import Expressions
from alight.theory.falsification.loop import Loop, assembled, at_errors, entries, errors
from alight.theory.falsification.numeric import numeric
from alight.theory.falsification.robot import told_the_truth
from alight.theory.falsification.space import Columns, Range, Space, both, linear, log
from alight.theory.proven import robot_bounds_of

LONGEST = 1.0
"""Time [s] after which a run is given up."""
SINGULAR = 0.1
"""Sine of the elbow's angle at which a run is cut: ``J`` is singular where it vanishes."""
PATIENCE = 4_000
"""Evaluations of the rates after which a run is given up."""
SOLVER = 1e-6
"""Relative error of the time of contact that the solver may have."""


class _TooLong(Exception):
    """A run that is stiffer than it is worth."""


def searches(claims: Claims) -> Iterator[Search]:
    """First contact."""
    yield _in_time(claims)


def _resolved() -> Space:
    """Loops that an integrator resolves: gains, speeds and learning within a few decades."""
    ranges: dict[str, Range] = {
        **RESTING,
        **{name: log(0.2, 0.5) for name in ("l1", "l2")},
        **{name: log(0.05, 1.0) for name in ("p2", "p1_beyond_p2")},
        "p3_share": linear(-0.5, 0.5),
        **{name: log(0.3, 30.0) for name in ("m", "k1", "alpha3", "alpha_1", "alpha_2")},
        **{name: log(3.0, 1e2) for name in ("alpha1", "alpha2")},
        **{name: log(0.1, 1e2) for name in ("k3_1", "k3_2")},
        "k2": log(0.1, 3.0),
        "K_I": log(1e3, 1e5),
        "k_s": log(1e2, 1e3),
        "e_m": log(0.01, 0.2),
        "q2": linear(0.5, 2.6),
        "behind": log(1e-3, 0.2),
        **{name: both(1e-3, 1.0) for name in ("r_r1", "r_r2")},
        "e_r2": both(1e-3, 0.1),
        "u_f": linear(-0.9, 0.9),
        **{f"Gamma_r{i + 1}": log(1e-6, 1e-2) for i in range(entries("horizontal"))},
    }
    return errors(ranges)


def _resting(c: Expressions) -> Loop:
    """The mass at rest, the tip some way behind it, the estimates true."""
    still = {name: ca.SX(0) for name in ("q1_dot", "q2_dot", "gap", "x_rd2")}
    before = assembled({**c, **still})
    lead = before.e.x_rd[0] - before.s.x_m
    placed = {"eta_m": before.e.eta_m, "e_r1": lead + c["behind"]}
    return told_the_truth(at_errors({**c, **placed}))


def _in_time(claims: Claims) -> Search:
    def late(columns: Columns, i: int) -> float:
        loop = numeric(_resting, columns, i)
        robot = robot_bounds_of(loop.law.model, loop.law, loop.s, loop.a)
        latest = claims.first_contact(loop.law, loop.s, loop.a, robot).latest
        if latest is None:
            return np.nan
        end = min(1.01 * latest, LONGEST)
        met = first_touch(loop, end)
        if met is None and end == LONGEST:
            return np.nan
        time = end if met is None else met
        return (time - latest) / (time + latest) - SOLVER

    def violation(columns: Columns) -> np.ndarray:
        return np.array([late(columns, i) for i in range(columns["m"].size)])

    claim = "the tip touches the resting mass no later than Proposition C says"
    return Search("C", claim, _resolved(), violation, (6, 48), f"runs of the loop; {METHOD}")


METHOD = "random, differential evolution, Nelder-Mead"


def first_touch(loop: Loop, end: float) -> float | None:
    """Time of first contact [s]; None if there is none until ``end``.

    NaN where the arm nears a singular pose or the filter its border, or the run takes too long.
    """
    from scipy.integrate import solve_ivp

    rates, p = _rates(), values_of(loop.law)

    def gap(_: float, x: np.ndarray) -> float:
        return float(np.asarray(rates(x, p)[1])[0, 0])

    def regular(_: float, x: np.ndarray) -> float:
        return float(min(abs(np.sin(x[1])) - SINGULAR, 1 - 1e-9 - abs(x[7])))

    gap.terminal = regular.terminal = True  # type: ignore[attr-defined]
    counted = itertools.count()

    def moving(_: float, x: np.ndarray) -> np.ndarray:
        if next(counted) > PATIENCE:
            raise _TooLong
        return np.asarray(rates(x, p)[0])[:, 0]

    try:
        run = solve_ivp(
            moving,
            (0.0, end),
            join_state(loop.law, loop.s, loop.a._asdict()),
            method="LSODA",
            rtol=1e-8,
            atol=1e-10,
            events=(gap, regular),
        )
    except _TooLong:
        return np.nan
    if not run.success or run.t_events[1].size:
        return np.nan
    return float(run.t_events[0][0]) if run.t_events[0].size else None


@functools.cache
def _rates() -> ca.Function:
    """Rates of a loop before contact and its gap, from its state and its parameters."""
    columns = {name: np.full(1, 0.5) for name in _resolved().ranges}
    lifted: Any = lift(numeric(_resting, columns, 0).law)
    column = ca.SX.sym("x", 19)
    law = lifted.obj
    moving, _ = continuous_rates(law.model, law, column, pressing=0.0)
    gap = law.model.arm.x_r(column[:2])[0] - column[4]
    return build("rates", {"x": column, "p": lifted.symbols}, {"x_dot": moving, "gap": gap})
