"""Attacks on what the proofs use of the projection."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import casadi as ca

from alight.scenarios import load_scenario
from alight.theory.falsification.claims import Claims
from alight.theory.falsification.hunt import Search
from alight.theory.falsification.judged import Expressions, Judged
from alight.theory.falsification.loop import DESIGN, estimated, placed
from alight.theory.falsification.space import Space, both

SPACE = Space(
    {
        "truth": both(1e-6, 1e6),
        "mu": both(1e-12, 1e12),
        **{name: DESIGN[name] for name in ("margin", "leak")},
        **estimated("dk"),
    }
)


def searches(claims: Claims) -> Iterator[Search]:
    """Both properties."""
    yield _helps(claims)
    yield _keeps(claims)


def _template() -> Any:
    return load_scenario("experiment-1").law.theta_dk  # type: ignore[attr-defined]


def _helps(claims: Claims) -> Search:
    def excess(c: Expressions) -> tuple[Any, Any]:
        box, hat = placed(_template(), c, c["truth"], ["dk"], claims.outside)
        theta_tilde, rate = c["truth"] - hat, box.project(c["mu"], hat)
        size = ca.fabs(theta_tilde) * (ca.fabs(rate) + ca.fabs(c["mu"]))
        return theta_tilde * (c["mu"] - rate), size

    claim = "theta_tilde (P - mu) >= 0 for a truth within its bounds"
    return Search("projection", claim, SPACE, Judged(SPACE, excess), (20_000, 200_000))


def _keeps(claims: Claims) -> Search:
    def excess(c: Expressions) -> tuple[Any, Any]:
        box, _ = placed(_template(), c, c["truth"], ["dk"])
        side = ca.sign(c["hat_dk"] - 0.5)
        middle = (box.lower + box.upper) / 2
        rate = box.project(c["mu"], middle + side * (box.half_width + claims.edge * box.epsilon))
        return side * rate, ca.fabs(rate) + ca.fabs(c["mu"])

    claim = "at the border of the widened interval the projected rate points inwards"
    return Search("projection", claim, SPACE, Judged(SPACE, excess), (20_000, 200_000))
