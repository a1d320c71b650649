"""Attacks on Proposition B and condition VTX: the mass in contact."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import casadi as ca
import numpy as np

from alight.control import Gains
from alight.symbolic.parameters import rebind
from alight.theory.falsification.claims import Claims
from alight.theory.falsification.hunt import Search
from alight.theory.falsification.judged import Evaluated, Expressions
from alight.theory.falsification.loop import DESIGN, at_errors, errors
from alight.theory.falsification.rounding import UNIT
from alight.theory.falsification.space import Columns, Space, linear
from alight.theory.lyapunov import V_m
from alight.theory.proven import schur_margin

SCALARS = ("k1", "k2", "alpha1", "alpha2", "alpha3", "Gamma")


def searches(claims: Claims) -> Iterator[Search]:
    """Everything about permanent contact."""
    yield _falls(claims)
    yield _implies_loc(claims)
    yield _least_at_rest(claims)


def gains_of(columns: Mapping[str, np.ndarray]) -> Gains:
    """Scalar gains of many tries; those of the robot are left out."""
    given = {name: columns[name] for name in SCALARS if name in columns}
    return rebind(object.__new__(Gains), **given)


def _falls(claims: Claims) -> Search:
    space = errors()

    def rate(c: Expressions) -> Expressions:
        loop = at_errors(c)
        parts = loop.rate(V_m)
        return {
            "gap": loop.e.gap,
            "rate": ca.sum1(parts),
            "size": ca.sum1(ca.fabs(parts)),
            "eta_m": loop.e.eta_m,
            "e_r1": loop.e.e_r[0],
        }

    measured = Evaluated(space, rate)

    def violation(columns: Columns) -> np.ndarray:
        values, rounding = measured(columns)
        m, K_I = columns["m"], columns["K_I"]
        margin = claims.vtx_margin(gains_of(columns), m, K_I)
        eta_m, e_r1 = np.abs(values["eta_m"]), np.abs(values["e_r1"])
        bound = K_I * eta_m * e_r1 - m * margin * eta_m**2
        size = values["size"] + K_I * eta_m * e_r1 + m * np.abs(margin) * eta_m**2
        moved = (
            rounding["rate"]
            + rounding["eta_m"] * (K_I * e_r1 + 2 * m * np.abs(margin) * eta_m)
            + rounding["e_r1"] * K_I * eta_m
        )
        over = (values["rate"] - bound - moved) / size - 32 * UNIT
        return np.where(values["gap"] > 0, over, np.nan)

    claim = "V_m_dot <= K |eta_m| |e_r1| - m (margin of VTX) eta_m^2 in contact"
    return Search("B", claim, space, violation, (8_000, 80_000))


def _implies_loc(claims: Claims) -> Search:
    names = ("m", "K_I", *SCALARS[:-1])
    space = Space({name: DESIGN[name] for name in names})

    def violation(columns: Columns) -> np.ndarray:
        g = gains_of(columns)
        vtx = claims.vtx_margin(g, columns["m"], columns["K_I"])
        size = g.alpha1 + g.alpha2 * (g.k1 + 1 / g.k1) + g.alpha3
        return np.minimum(vtx, -claims.loc_margin(g)) / size - 8 * UNIT

    claim = "VTX holds only where LOC holds"
    return Search("B", claim, space, violation, (40_000, 300_000))


def _least_at_rest(claims: Claims) -> Search:
    design = {name: DESIGN[name] for name in ("m", "K_I", *SCALARS[:-1])}
    space = Space({**design, "a": linear(0.0, 1.0), "b": linear(0.0, 1.0)})

    def violation(columns: Columns) -> np.ndarray:
        g, m, K_I = gains_of(columns), columns["m"], columns["K_I"]
        least = claims.vtx_margin(g, m, K_I)
        elsewhere = schur_margin(g, m, K_I, columns["a"], columns["b"])
        size = np.abs(least) + np.abs(elsewhere) + g.alpha2 * g.k1
        return (least - elsewhere) / size - 8 * UNIT

    claim = "the margin of VTX is the least over the unit square of (sech^2 e_m, sech^2 e_f)"
    return Search("B", claim, space, violation, (20_000, 200_000))
