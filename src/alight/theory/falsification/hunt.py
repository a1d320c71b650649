"""How a search looks: at random, by differential evolution, by Nelder and Mead."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from alight.theory.falsification.attempt import Attempt
from alight.theory.falsification.space import Columns, Space

Effort = Literal["quick", "full"]
BATCH = 4096
"""Tries that are evaluated together."""
POPULATION = 64
"""Members of the evolution at most; it begins with the best of the random tries."""
METHOD = "random over many decades, differential evolution, Nelder-Mead"


@dataclass(frozen=True)
class Search:
    """One claim under attack."""

    proposition: str
    claim: str
    space: Space
    violation: Callable[[Columns], np.ndarray]
    """Relative violation of the claim at each try, less what rounding explains; NaN or infinite
    where the claim says nothing."""
    tries: tuple[int, int]
    """Random tries at quick and at full effort; as many go into the rest."""
    method: str = METHOD

    def run(self, seed: int, effort: Effort) -> Attempt:
        """Search, the same way for the same seed."""
        hunt = _Hunt(self, np.random.default_rng(seed))
        random = self.tries[effort == "full"]
        population = min(POPULATION, max(random // 8, 5))
        hunt.at_random(random)
        hunt.evolve(population, random // (2 * population))
        hunt.climb(min(max(random // 20, 50), random))
        at = self.space.columns(hunt.best_at[:, None])
        return Attempt(
            proposition=self.proposition,
            claim=self.claim,
            tries=hunt.count,
            best=hunt.best,
            at={name: float(column[0]) for name, column in at.items()},
            method=self.method,
        )


class _Hunt:
    """The state of a search."""

    def __init__(self, search: Search, rng: np.random.Generator) -> None:
        self._search, self._rng = search, rng
        self.count, self.best = 0, -np.inf
        self.best_at = np.full(search.space.size, 0.5)
        self._leading = np.empty((search.space.size, 0))
        self._values = np.empty(0)

    def violation(self, shares: np.ndarray) -> np.ndarray:
        """Evaluate tries of shape (size, tries), and remember the best."""
        with np.errstate(all="ignore"):
            found = self._search.violation(self._search.space.columns(shares))
        found = np.where(np.isfinite(found), found, -2.0)
        self.count += found.size
        first = int(found.argmax())
        if found[first] > self.best:
            self.best, self.best_at = float(found[first]), shares[:, first].copy()
        return found

    def at_random(self, tries: int) -> None:
        """Sample the whole space, and keep the best few."""
        for start in range(0, tries, BATCH):
            shares = self._rng.random((self._search.space.size, min(BATCH, tries - start)))
            found = self.violation(shares)
            both = np.concatenate([self._values, found])
            order = np.argsort(both)[::-1][:POPULATION]
            self._leading = np.hstack([self._leading, shares])[:, order]
            self._values = both[order]

    def evolve(self, population: int, generations: int) -> None:
        """Differential evolution from the best few on."""
        if not generations:
            return
        from scipy.optimize import differential_evolution

        differential_evolution(
            lambda shares: -self.violation(shares),
            [(0.0, 1.0)] * self._search.space.size,
            init=self._leading[:, :population].T,
            maxiter=generations,
            mutation=(0.3, 1.0),
            tol=0.0,
            polish=False,
            updating="deferred",
            vectorized=True,
            seed=self._rng,
        )

    def climb(self, tries: int) -> None:
        """Nelder-Mead from the best on."""
        from scipy.optimize import minimize

        minimize(
            lambda share: -float(self.violation(np.clip(share, 0.0, 1.0)[:, None])[0]),
            self.best_at,
            method="Nelder-Mead",
            options={"maxfev": tries, "adaptive": True, "xatol": 1e-12, "fatol": 0.0},
        )
