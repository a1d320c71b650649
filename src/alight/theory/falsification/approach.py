"""Attacks on Propositions C and D and on the filter's domain: before contact."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import casadi as ca
import numpy as np

from alight.theory.falsification.claims import Claims
from alight.theory.falsification.contact import gains_of
from alight.theory.falsification.hunt import Search
from alight.theory.falsification.judged import Evaluated, Expressions, Judged
from alight.theory.falsification.loop import assembled, loops
from alight.theory.falsification.rounding import UNIT
from alight.theory.falsification.space import Columns, Range, Space, constant, linear, log
from alight.theory.lyapunov import V_r

RESTING: dict[str, Range] = {"Y_d": constant(0.0), "x_m_dot": constant(0.0), "e_m": log(1e-6, 5.0)}
"""A mass at rest at ``x_0``."""
ANGLES = np.pi / 2 * (np.arange(1024) + 0.5) / 1024
"""Phases of a quarter of a swing: with both signs of the deflection they cover the whole."""


def searches(claims: Claims) -> Iterator[Search]:
    """Everything about the way to the first contact."""
    yield _leads(claims)
    yield _falls_by_the_lead(claims)
    yield _swing(claims)
    yield _stays(claims)


def _leads(claims: Claims) -> Search:
    space = loops(RESTING)

    def at_rest(c: Expressions) -> Expressions:
        # (18) is affine in alpha1: the one for which the filter rests at the given u_f
        without, with_one = (assembled({**c, "alpha1": ca.SX(v)}).e.u_f_dot for v in (0, 1))
        alpha1 = without / (without - with_one)
        loop = assembled({**c, "alpha1": alpha1})
        return {"alpha1": alpha1, "lead": loop.e.x_rd[0] - loop.s.x_m}

    measured = Evaluated(space, at_rest)

    def violation(columns: Columns) -> np.ndarray:
        values, errors = measured(columns)
        gains, w = gains_of({**columns, **values}), np.tanh(columns["e_m"])
        admitted = (gains.alpha1 > 0) & (claims.filter_room(gains, columns["e_m"], 0.0) > 0)
        short = claims.least_lead(gains, w) - values["lead"] - errors["lead"]
        return np.where(admitted, short / (gains.k2 * w + np.abs(values["lead"])), np.nan)

    claim = "s_inf > 0: the desired position comes to rest beyond the mass"
    return Search("C", claim, space, violation, (8_000, 40_000))


def _falls_by_the_lead(claims: Claims) -> Search:
    far = log(1e-9, 1e1)
    space = loops({**RESTING, "gap": lambda share: -far(share)})

    def excess(c: Expressions) -> tuple[Any, Any]:
        loop = assembled(c)
        lead = ca.fmax(loop.e.x_rd[0] - loop.s.x_m, 0.0)
        held = loop.law.feedback(ca.vertcat(lead, 0.0), ca.SX.zeros(2))[0]
        parts, owed = loop.rate(V_r), claims.approach(loop.law, lead, held)
        return ca.sum1(parts) + owed, ca.sum1(ca.fabs(parts)) + owed

    claim = "before contact V_r falls by alpha_1 s f(s) at least, s the lead where it is positive"
    return Search("C", claim, space, Judged(space, excess), (4_000, 40_000))


def _swing(claims: Claims) -> Search:
    space = Space({"middle": linear(-3.0, 3.0), "amplitude": log(1e-4, 1e2)})

    def violation(columns: Columns) -> np.ndarray:
        middle, swung = columns["middle"], np.outer(columns["amplitude"], np.cos(ANGLES))
        sides = np.tanh(middle[:, None] + swung) ** 2 + np.tanh(middle[:, None] - swung) ** 2
        average = sides.mean(axis=1) / 2
        floor = np.array([claims.swing_floor(d) for d in middle])
        return (floor - average) / (floor + average) - 64 * UNIT

    claim = "tanh^2 of a free swing is on average above the floor of its middle, at any amplitude"
    return Search("D", claim, space, violation, (4_000, 60_000))


def _stays(claims: Claims) -> Search:
    borders: dict[str, Range] = {"u_f": lambda share: np.where(share < 0.5, -1.0, 1.0)}
    space = loops({**borders, "share": linear(-2.0, 2.0)})

    def border(c: Expressions) -> Expressions:
        loop = assembled({**c, "x_m_dot": ca.SX(0)})
        speed = loop.law.gains.alpha1 * ca.tanh(c["e_m"]) + c["share"] * loop.law.gains.alpha2
        moving = assembled({**c, "x_m_dot": speed})
        return {"speed": speed, "outward": c["u_f"] * moving.e.u_f_dot}

    measured = Evaluated(space, border)

    def violation(columns: Columns) -> np.ndarray:
        values, errors = measured(columns)
        g = gains_of(columns)
        room = claims.filter_room(g, columns["e_m"], values["speed"]) / g.alpha2
        size = g.k1 * (np.abs(values["speed"]) + g.alpha1 + g.alpha2)
        outward = (values["outward"] - errors["outward"]) / size
        return np.minimum(room - 8 * UNIT * (1 + np.abs(values["speed"]) / g.alpha2), outward)

    claim = "|u_f| < 1 is kept where alpha2 > |alpha1 tanh(e_m) - x_m_dot|"
    return Search("filter", claim, space, violation, (8_000, 80_000))
