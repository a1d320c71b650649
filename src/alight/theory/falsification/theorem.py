"""Attacks on the inequalities of the paper's proof, as corrected: (23), (49), (71), and 3.1."""

from __future__ import annotations

from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np

from alight.symbolic.ops import as_vector
from alight.theory.falsification.attempt import Attempt
from alight.theory.falsification.claims import Claims
from alight.theory.falsification.contact import gains_of
from alight.theory.falsification.hunt import Effort, Search
from alight.theory.falsification.judged import Evaluated, Expressions
from alight.theory.falsification.loop import Loop, assembled, at_errors, errors, loops
from alight.theory.falsification.robot import told_the_truth
from alight.theory.falsification.rounding import UNIT
from alight.theory.falsification.space import Columns, log
from alight.theory.lyapunov import V, dissipation
from alight.theory.theorem_1.formulas import Corrected, Printed
from alight.theory.theorem_1.nonlinear_damping import nonlinear_damping
from alight.theory.theorem_1.search import search_for_a_feasible_design


def searches(claims: Claims) -> Iterator[Search]:
    """The inequalities that the conditions of Theorem 1 rest on."""
    yield _above_V(claims)
    yield _above_chi(claims)
    yield _decrease_in_contact(claims)


def joint(claims: Claims, seed: int, effort: Effort) -> Iterator[Attempt]:
    """The search for a design that satisfies (26), (37), (38) and (70) together."""
    generations = 12 if effort == "quick" else 60
    for formulas, told in ((Printed(), "as printed"), (Corrected(), "as corrected")):
        found = search_for_a_feasible_design(formulas, claims.stiffness, seed, generations)
        g, b = found.design.gains, found.design.bounds
        scalars = {name: getattr(g, name) for name in ("k1", "k2", "alpha1", "alpha2", "alpha3")}
        yield Attempt(
            proposition="3.1",
            claim=f"no design satisfies (26), (37), (38) and (70) at the limit of K_I, {told}",
            tries=found.tried,
            best=found.margin,
            at={**scalars, "m_l": b.m_l, "zeta_K": b.zeta_K[1]},
            method="differential evolution on the least margin",
        )


def _exact(c: Expressions) -> Loop:
    """A loop without parameter errors: the estimate stands where its box holds the truth."""
    below, above, margin = (c[name] for name in ("below_dk", "above_dk", "margin"))
    share = (below / (below + above) + margin / 2) / (1 + margin)
    return told_the_truth(at_errors({**c, "hat_dk": share}))


def _square(*parts: Any) -> Any:
    return sum(ca.sumsqr(ca.SX(part)) for part in parts)


def _known(columns: Columns, i: int, a2: float = 0.0) -> Any:
    """What the formulas of Theorem 1 read of a design whose plant is known."""
    scalars = ("k1", "k2", "alpha1", "alpha2", "alpha3")
    m, K_I = columns["m"][i], columns["K_I"][i]
    return SimpleNamespace(
        gains=SimpleNamespace(**{name: columns[name][i] for name in scalars}),
        bounds=SimpleNamespace(m_l=m, m_u=m, zeta_K=(K_I, K_I)),
        inertia=SimpleNamespace(a2=a2),
    )


def _above_V(claims: Claims) -> Search:
    space = errors()

    def sides(c: Expressions) -> Expressions:
        loop = _exact(c)
        e, M_bar = loop.e, loop.law.model.arm.M_bar(loop.s.q)
        half, skew = (M_bar[0, 0] + M_bar[1, 1]) / 2, (M_bar[0, 0] - M_bar[1, 1]) / 2
        e_f = (ca.log1p(c["u_f"]) - ca.log1p(-c["u_f"])) / 2
        return {
            "V": V(loop.law.model, loop.law, loop.s, loop.a),
            "z_bar": _square(e.r_r, e.e_r, e.eta_m, e.e_m, e_f),
            "a2": half + ca.sqrt(skew**2 + M_bar[0, 1] ** 2),
        }

    measured = Evaluated(space, sides)

    def violation(columns: Columns) -> np.ndarray:
        values, rounding = measured(columns)
        designs = (_known(columns, i, a2) for i, a2 in enumerate(values["a2"]))
        weight = np.array([claims.formulas.lambda_1(d) for d in designs])
        bound = weight * values["z_bar"]
        moved = rounding["V"] + weight * rounding["z_bar"] + rounding["a2"] * values["z_bar"]
        return (values["V"] - bound - moved) / (values["V"] + bound)

    claim = "V <= lambda_1 |z_bar|^2 + zeta_theta with lambda_1 of (49) as corrected"
    return Search("(49)", claim, space, violation, (3_000, 20_000))


def _above_chi(claims: Claims) -> Search:
    space = loops()

    def eta_m(_: Any, law: Any, s: Any, a: Any) -> Any:
        return law.filter_rates(s.x_m, s.x_m_dot, a.u_f, a.theta_dk_hat)[0]

    def sides(c: Expressions) -> Expressions:
        free = assembled({**c, "gap": ca.SX(-1)})
        e, g, body = free.e, free.law.gains, free.law.model.body
        inertial = body.m * (ca.sum1(free.rate(eta_m)) + g.alpha2 * g.k1 * e.eta_m)
        return {
            "chi": inertial - body.k_s * body.Y_d(free.s.x_m),
            "z": ca.sqrt(_square(e.eta_m, ca.tanh(e.e_m), c["u_f"])),
        }

    measured = Evaluated(space, sides)

    def violation(columns: Columns) -> np.ndarray:
        values, rounding = measured(columns)
        designs = (_known(columns, i) for i in range(columns["m"].size))
        zeta = np.array([claims.zeta_1(d.gains, d.bounds.m_u) for d in designs])
        chi, bound = np.abs(values["chi"]), zeta * values["z"]
        return (chi - bound - rounding["chi"] - zeta * rounding["z"]) / (chi + bound) - 32 * UNIT

    claim = "|chi| <= zeta_1 |z|, (23) by the rule of vertices"
    return Search("(23)", claim, space, violation, (3_000, 20_000))


def _decrease_in_contact(claims: Claims) -> Search:
    space = errors({"k_n1_over": log(1e-3, 1e3), "k1_over": log(1.0, 1e2)})

    def sides(c: Expressions) -> Expressions:
        loop = _exact(c)
        e, parts, tip = loop.e, loop.rate(V), dissipation(loop.law, loop.e)
        lag = ca.sum1(e.r_r**2 / as_vector(loop.law.gains.alpha))
        return {
            "gap": e.gap,
            "excess": ca.sum1(parts) + tip - lag,
            "size": ca.sum1(ca.fabs(parts)) + tip + lag,
            "eta_m": e.eta_m,
            "z": _square(e.eta_m, ca.tanh(e.e_m), c["u_f"]),
        }

    measured = Evaluated(space, sides)

    def violation(columns: Columns) -> np.ndarray:
        columns = {**columns, "k1": _k1_of_26(columns)}
        values, rounding = measured(columns)
        designs = (_known(columns, i) for i in range(columns["m"].size))
        beta = np.array([nonlinear_damping(d).beta for d in designs])
        g = gains_of(columns)
        of_eta = claims.of_eta(g.alpha2, columns["K_I"], columns["alpha_1"])
        square = values["eta_m"] ** 2
        over = values["excess"] + beta * values["z"] + of_eta * square
        moved = rounding["excess"] + beta * rounding["z"]
        moved = moved + 2 * np.abs(of_eta * values["eta_m"]) * rounding["eta_m"]
        size = values["size"] + beta * values["z"] + np.abs(of_eta) * square
        return np.where(values["gap"] > 0, (over - moved) / size - 32 * UNIT, np.nan)

    claim = "(71) as corrected: 2 alpha2 - zeta_K^2 / (4 alpha) before eta_m^2, axis by axis"
    return Search("(71)", claim, space, violation, (3_000, 20_000))


def _k1_of_26(columns: Columns) -> np.ndarray:
    """A ``k1`` that (26) allows, with a ``k_n1`` that (37) allows."""
    found = []
    for i in range(columns["m"].size):
        damping, m = nonlinear_damping(_known(columns, i)), columns["m"][i]
        k_n1 = damping.floor * (1 + columns["k_n1_over"][i])
        found.append(columns["k1_over"][i] * (3 + k_n1 * damping.zeta_1**2) / m)
    return np.array(found)
