"""Attacks on condition LOC: its verdict against eigenvalues."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import casadi as ca
import numpy as np

from alight.simulation.continuous import continuous_rates, join_state
from alight.symbolic.parameters import rebind
from alight.theory.falsification.claims import Claims
from alight.theory.falsification.contact import SCALARS, gains_of
from alight.theory.falsification.hunt import Search
from alight.theory.falsification.judged import Evaluated, Expressions
from alight.theory.falsification.loop import DESIGN, Loop, assembled, loops
from alight.theory.falsification.space import Columns, Space, log

EIGENVALUES = 1e-11
"""Relative error that the eigenvalues of a matrix of the mass and its filter may have."""
BRISTLE = 6
"""The state of the friction, which the lossless loop has not."""
OF_THE_LOOP = 1e-6
"""The same for the whole loop, whose multiple eigenvalues at zero move by the root of rounding."""
UNLUCKY = 100
"""By how much rounding can be worse than one draw of it."""


DRAW = np.random.default_rng(0).uniform(-1.0, 1.0, (18, 18))
"""One draw of rounding, as a share of what it can be."""
Stack = Callable[[Columns], tuple[np.ndarray, np.ndarray]]


def searches(claims: Claims) -> Iterator[Search]:
    """Everything about small motions about contact."""
    yield _verdict(claims, adapting=False)
    yield _verdict(claims, adapting=True)
    yield _of_the_whole_loop(claims)
    yield _least_stiffness(claims)


def disagreement(margin: np.ndarray, growth: np.ndarray) -> np.ndarray:
    """Positive where a positive margin meets growth, or a negative one decay."""
    return np.maximum(np.minimum(margin, growth), np.minimum(-margin, -growth))


def _matrix(loop: Loop, rows: list[int], tracked: bool) -> Any:
    """Linearisation about contact at rest, of some states of the loop."""
    law = loop.law
    column = join_state(law, loop.s, loop.a._asdict())
    free = ca.SX.sym("x", column.numel())

    def rates(x: Any) -> Any:
        moving, _ = continuous_rates(law.model, law, x, pressing=1.0)
        return moving

    moving = _perfectly_tracked(loop, free) if tracked else rates(free)
    slope = ca.jacobian(moving, free)
    return ca.substitute(slope, free, column)[rows, rows]


def _perfectly_tracked(loop: Loop, x: Any) -> Any:
    """Rates of the mass, the filter and ``theta_dk_hat`` when the tip is where it is wanted."""
    law, plant = loop.law, loop.law.model
    x_m, x_m_dot, u_f, theta = x[4], x[5], x[7], x[8]
    gap = law.x_rd1(x_m, u_f, theta) - x_m
    pushed = plant.contact.force(gap, 0.0, 1.0)
    _, u_f_dot, theta_dot = law.filter_rates(x_m, x_m_dot, u_f, theta)
    rates = {4: x_m_dot, 5: plant.body.acceleration(x_m, x_m_dot, pushed), 7: u_f_dot, 8: theta_dot}
    return ca.vertcat(*(rates.get(i, ca.SX(0)) for i in range(x.numel())))


def at_rest(c: Expressions) -> Loop:
    """The contact equilibrium of a loop: on target, true estimates, the filter at rest."""
    held = c["k_s"] * c["Y_d"] / c["K_I"]
    still = {"q1_dot": 0.0, "q2_dot": 0.0, "x_m_dot": 0.0, "u_f": 0.0, "e_m": 0.0, "gap": held}
    loop = assembled({**c, **{name: ca.SX(value) for name, value in still.items()}})
    law, plant = loop.law, loop.law.model
    x_rd2 = plant.arm.x_r(loop.s.q)[1]
    law = rebind(law, target=rebind(law.target, x_rd2=x_rd2))
    truth = law.theta_r_of(law.pi_of(plant))
    return Loop(law, loop.s, loop.a._replace(theta_dk_hat=plant.theta_dk, theta_r_hat=truth))


def _growth(matrices: np.ndarray, rounding: float) -> np.ndarray:
    """Largest real part over the largest magnitude; zero where rounding decides."""
    found = np.linalg.eigvals(matrices)
    growth = found.real.max(axis=1) / np.abs(found).max(axis=1)
    return np.sign(growth) * np.maximum(np.abs(growth) - rounding, 0.0)


def _stacked(space: Space, rows: list[int], tracked: bool) -> Stack:
    """Matrices of many tries, shape (tries, n, n), and how far rounding can have moved them."""
    n = len(rows)

    def entries(c: Expressions) -> Expressions:
        matrix = _matrix(at_rest(c), rows, tracked)
        return {f"A{i}_{j}": matrix[i, j] for i in range(n) for j in range(n)}

    measured = Evaluated(space, entries)

    def matrices(columns: Columns) -> tuple[np.ndarray, np.ndarray]:
        values, errors = (np.array(list(part.values())) for part in measured(columns))
        return values.T.reshape(-1, n, n), errors.T.reshape(-1, n, n)

    return matrices


def _relative(margin: np.ndarray, columns: Columns) -> np.ndarray:
    g = gains_of(columns)
    return margin / (g.alpha1 + g.alpha2 * (g.k1 + 1 / g.k1) + g.alpha3)


def _verdict(claims: Claims, adapting: bool) -> Search:
    rows = [4, 5, 7, 8] if adapting else [4, 5, 7]
    space = loops({"Y_d": log(1e-3, 1.0), "below_dk": log(0.5, 1.0)})
    matrices = _stacked(space, rows, tracked=True)

    def violation(columns: Columns) -> np.ndarray:
        g = gains_of(columns)
        kappa = columns["K_I"] / columns["m"]
        margin = (
            claims.loc_adapting_margin(g, kappa, columns["Y_d"])
            if adapting
            else claims.loc_margin(g)
        )
        return (
            disagreement(_relative(margin, columns), _growth(matrices(columns)[0], EIGENVALUES))
            - EIGENVALUES
        )

    told = "with theta_dk_hat adapting" if adapting else "theta_dk_hat at rest"
    claim = f"LOC's sign is that of the decay of mass and filter, {told}"
    return Search("LOC", claim, space, violation, (8_000, 50_000))


def _of_the_whole_loop(claims: Claims) -> Search:
    space = loops({"Y_d": log(1e-3, 0.1), "below_dk": log(0.5, 1.0)})
    whole = _stacked(space, [i for i in range(19) if i != BRISTLE], tracked=False)
    tracked = _stacked(space, list(claims.decisive), tracked=True)

    def violation(columns: Columns) -> np.ndarray:
        (loop, rounding), (mass, _) = whole(columns), tracked(columns)
        usable = np.isfinite(loop + rounding).all(axis=(1, 2))
        loop, rounding = (np.where(usable[:, None, None], part, 0.0) for part in (loop, rounding))
        found, moved = (np.linalg.eigvals(part) for part in (loop, loop + rounding * DRAW))
        growth, shifted = found.real.max(axis=1), moved.real.max(axis=1)
        missed = growth - np.maximum(np.linalg.eigvals(mass).real.max(axis=1), 0.0)
        unsure = UNLUCKY * np.abs(shifted - growth)
        size = np.abs(found).max(axis=1)
        return np.where(usable, (np.abs(missed) - unsure) / size - OF_THE_LOOP, np.nan)

    claim = "the whole lossless loop grows just as its mass and filter do under perfect tracking"
    return Search("LOC", claim, space, violation, (1_000, 8_000))


def _least_stiffness(claims: Claims) -> Search:
    design = {name: DESIGN[name] for name in ("m", "K_I", *SCALARS)}
    space = Space({**design, "compression": log(1e-4, 1.0), "stiffer": log(1.0, 1e4)})

    def violation(columns: Columns) -> np.ndarray:
        g, kappa = gains_of(columns), columns["K_I"] / columns["m"]
        soft, stiff = (
            claims.loc_adapting_margin(g, kappa * factor, columns["compression"])
            for factor in (1.0, columns["stiffer"])
        )
        return (soft - stiff) / (np.abs(soft) + np.abs(stiff)) - 1e-12

    claim = "LOC with adaptation grows with K_I / m: the softest is the worst"
    return Search("LOC", claim, space, violation, (40_000, 300_000))
