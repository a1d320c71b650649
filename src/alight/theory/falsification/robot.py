"""Attacks on Proposition A: ``V_r`` falls, and what follows from it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import casadi as ca

from alight.control import AdaptiveContactLaw, AdaptiveState, ForceLimiting, Unsaturated
from alight.models import Plant, PlantState
from alight.symbolic.ops import dot
from alight.symbolic.parameters import rebind
from alight.theory.falsification.claims import Claims
from alight.theory.falsification.hunt import Search
from alight.theory.falsification.judged import Expressions, Judged
from alight.theory.falsification.loop import Loop, Plane, assembled, at_errors, errors, loops
from alight.theory.falsification.space import log
from alight.theory.lyapunov import V_r, errors_at


def searches(claims: Claims) -> Iterator[Search]:
    """Everything about the robot part."""
    yield _falls(claims, ForceLimiting, "horizontal", "law (32)", (8_000, 80_000))
    yield _falls(claims, Unsaturated, "horizontal", "law (44)", (4_000, 30_000))
    yield _falls(claims, ForceLimiting, "vertical", "law (32), with gravity", (4_000, 30_000))
    yield _bounds_r_r(claims)
    yield _effort(claims)
    yield _replaces_39(claims)


def _falls(
    claims: Claims, cls: type[AdaptiveContactLaw], plane: Plane, told: str, tries: tuple[int, int]
) -> Search:
    space = loops(plane=plane)

    def excess(c: Expressions) -> tuple[Any, Any]:
        loop = assembled(c, cls, claims.outside)
        parts, owed = loop.rate(V_r), claims.dissipation(loop.law, loop.e)
        return ca.sum1(parts) + owed, ca.sum1(ca.fabs(parts)) + owed

    claim = f"V_r falls by its dissipation at least, in contact and out of it: {told}"
    return Search("A", claim, space, Judged(space, excess), tries)


def told_the_truth(loop: Loop) -> Loop:
    """The same with true estimates of ``theta_r``: all of ``V_r`` is then in the errors."""
    law = loop.law
    truth = law.theta_r_of(law.pi_of(law.model))
    return Loop(law, loop.s, loop.a._replace(theta_r_hat=truth))


def _bounds_r_r(claims: Claims) -> Search:
    space = errors()

    def excess(c: Expressions) -> tuple[Any, Any]:
        loop = told_the_truth(at_errors(c))
        J, M = loop.law.model.arm.J(loop.s.q), loop.law.model.arm.M(loop.s.q)
        mobility = (J @ ca.inv_minor(M) @ J.T)[0, 0]
        square = loop.e.r_r[0] ** 2
        bound = claims.r_r_squared(V_r(loop.law.model, loop.law, loop.s, loop.a), mobility)
        return square - bound, square + bound

    return Search(
        "A", "r_r1^2 <= 2 V_r (M_bar^-1)_11", space, Judged(space, excess), (4_000, 30_000)
    )


def _effort(claims: Claims) -> Search:
    space = loops({"beyond": log(1.0, 1e6)})

    def excess(c: Expressions) -> tuple[Any, Any]:
        loop = assembled(c)
        e_r1 = loop.e.e_r[0]
        largest = c["beyond"] * e_r1

        def holding(e: Any) -> Any:
            return loop.law.feedback(ca.vertcat(e, 0.0), ca.SX.zeros(2))[0]

        bound = claims.steepness(largest, holding(largest)) * e_r1 * holding(e_r1)
        return e_r1**2 - bound, e_r1**2 + bound

    claim = "e_r1^2 <= (S / f(S)) e_r1 f(e_r1) for |e_r1| <= S: the integral of e_r1^2 is bounded"
    return Search("A", claim, space, Judged(space, excess), (4_000, 40_000))


def _replaces_39(claims: Claims) -> Search:
    space = errors({f"over_{i}": log(1.0, 1e2) for i in (1, 2)})

    def excess(c: Expressions) -> tuple[Any, Any]:
        loop = told_the_truth(at_errors(c))
        r_r, unit = loop.e.r_r, loop.law.feedback(ca.SX.zeros(2), loop.e.r_r)
        needed = claims.tracking(r_r, unit / loop.law.gains.k3) / loop.law.gains.alpha
        over = ca.vertcat(c["over_1"], c["over_2"])
        law = rebind(loop.law, gains=rebind(loop.law.gains, k3=over * needed))

        def robot_part(
            plant: Plant, law: AdaptiveContactLaw, s: PlantState, a: AdaptiveState
        ) -> Any:
            e_r = errors_at(law, s, a).e_r
            return V_r(plant, law, s, a) + dot(e_r, e_r)

        parts = Loop(law, loop.s, loop.a).rate(robot_part)
        return ca.sum1(parts), ca.sum1(ca.fabs(parts))

    claim = "V_r + e_r^T e_r falls where k3_i alpha_i > k3_i r / f(r) on each axis: replaces (39)"
    return Search("A", claim, space, Judged(space, excess), (4_000, 30_000))
