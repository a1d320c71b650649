"""The integrator of a sample interval: fixed steps, each split where the contact switches."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from alight.symbolic.ops import Scalar, is_symbolic, where

Rates = Callable[[Any], Any]
SEARCH = 6
"""Steps of the search for the instant of a switch: its error falls below that of the step."""


class Step(NamedTuple):
    """A Runge-Kutta step and the polynomial that follows it."""

    following: Any
    """State after the step."""
    between: Callable[[Scalar], Any]
    """State after a share of the step, of order 4; it costs one more evaluation of the rates."""


def dormand_prince(rates: Rates, x: Any, dt: Any) -> Step:
    """One step of the method of Dormand and Prince, order 5 where ``rates`` is smooth.

    Its six evaluations reach further than eight of two classical steps. J. Comp. Appl. Math. 6,
    1980; the dense output is Shampine's, Math. Comp. 46, 1986. The coefficients are SciPy's.
    """
    from scipy.integrate import RK45  # a third of a second, which an import need not cost

    slopes: list[Any] = []
    for row in RK45.A:
        slopes.append(rates(x + _weighted(dt, row[: len(slopes)], slopes)))
    following = x + _weighted(dt, RK45.B, slopes)

    @functools.cache
    def last() -> Any:
        return rates(following)

    def between(share: Scalar) -> Any:
        powers = [share ** (k + 1) for k in range(RK45.P.shape[1])]
        weights = [_weighted(1.0, row, powers) for row in RK45.P]
        return x + _weighted(dt, weights, [*slopes, last()])

    return Step(following, between)


def dormand_prince_step(rates: Rates, x: Any, dt: Any) -> Any:
    """State after one step of `dormand_prince`."""
    return dormand_prince(rates, x, dt).following


def _weighted(dt: Any, weights: Sequence[Any], values: Sequence[Any]) -> Any:
    """``dt`` times a sum of products: ``dt`` goes to the weights, which no tick need multiply."""
    used = [(w, v) for w, v in zip(weights, values, strict=True) if is_symbolic(w) or w != 0]
    return sum((dt * w * v for w, v in used[1:]), dt * used[0][0] * used[0][1]) if used else 0.0


class Phases(NamedTuple):
    """A system of two smooth phases, 1 and 0, that change where a guard changes its sign."""

    rates: Callable[[Any, Scalar], Any]
    """Rate of a state in a given phase."""
    guard: Callable[[Any], Scalar]
    """Zero or above in phase 1, below zero in phase 0."""

    def phase(self, x: Any) -> Scalar:
        """Phase of a state."""
        return where(self.guard(x) >= 0, 1.0, 0.0)

    def step(self, x: Any, dt: Any) -> tuple[Any, Scalar]:
        """State after a step in the phase of its start, and 1 if the phase has changed by then."""
        phase = self.phase(x)
        following = dormand_prince_step(lambda at: self.rates(at, phase), x, dt)
        return following, where(self.phase(following) == phase, 0.0, 1.0)

    def split_step(self, x: Any, dt: Any) -> Any:
        """State after a step that is split at the switch, if one lies within it.

        A second switch in the same step is not seen.
        """
        phase = self.phase(x)
        whole = dormand_prince(lambda at: self.rates(at, phase), x, dt)
        before = _root(
            lambda share: self.guard(whole.between(share)),
            self.guard(x),
            self.guard(whole.following),
        )
        switch = dormand_prince_step(lambda at: self.rates(at, phase), x, before * dt)
        after = dormand_prince_step(lambda at: self.rates(at, 1 - phase), switch, (1 - before) * dt)
        changed = self.phase(whole.following) != phase
        return where(changed, after, whole.following)


def _root(value: Callable[[Scalar], Scalar], at_0: Scalar, at_1: Scalar) -> Scalar:
    """Share of a step at which a value changes its sign.

    The Pegasus method: Dowell and Jarratt, BIT 12, 1972.
    """
    kept, f_kept = 0.0, at_0
    latest, f_latest = 1.0, at_1
    for _ in range(SEARCH):
        found = latest - (latest - kept) * _share(f_latest, f_latest - f_kept)
        f_found = value(found)
        crossed = f_found * f_latest < 0
        f_kept = where(crossed, f_latest, f_kept * _share(f_latest, f_latest + f_found))
        kept = where(crossed, latest, kept)
        latest, f_latest = found, f_found
    return latest


def _share(part: Scalar, whole: Scalar) -> Scalar:
    """A quotient; 0 where its denominator is."""
    none = whole == 0
    return where(none, 0.0, part / where(none, 1.0, whole))
