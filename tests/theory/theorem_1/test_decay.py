"""lambda and V_u: the largest solution of what the paper leaves circular, or why there is none."""

from __future__ import annotations

import numpy as np
import pytest

from alight.theory.theorem_1 import Corrected, Printed
from alight.theory.theorem_1.decay import V_u, decay, needed
from tests.theory.theorem_1.designs import log_uniform, random_design, with_gains

READINGS = (Printed(), Corrected())


def T(d, f, beta, rate):
    """What lambda may be at most, given the V_u of a lambda."""
    load = needed(d, V_u(d, f, np.sqrt(f.epsilon_x(d) / rate)))
    axes = f.axes(d)
    return min(beta, *(alpha for _, alpha in axes), *(k3 - load / alpha for k3, alpha in axes))


def tight_design(rng, f):
    """A design whose k3 alpha is about what (39) needs, so that the circle bites."""
    d = random_design(rng)
    beta = log_uniform(rng, 1.1, 100.0) * f.epsilon_x(d)
    load = needed(d, V_u(d, f, np.sqrt(f.epsilon_x(d) / beta)))
    alpha = tuple(beta * log_uniform(rng, 0.5, 30.0) for _ in range(2))
    k3 = tuple(load / a + beta * rng.uniform(0.0, 3.0) for a in alpha)
    if isinstance(f, Printed):  # it takes the least of each, which need not be on one axis
        alpha, k3 = (alpha[0],) * 2, (k3[0],) * 2
    return with_gains(d, alpha=alpha, k3=k3), beta


@pytest.mark.parametrize("f", READINGS, ids=["printed", "corrected"])
def test_lambda_is_the_largest_solution_that_a_scan_finds(f):
    rng = np.random.default_rng(0)
    seen = {"none": 0, "ceiling": 0, "inner": 0}
    for _ in range(120):
        d, beta = tight_design(rng, f)
        found = decay(d, f, beta)
        epsilon_x, ceiling = found.epsilon_x, found.ceiling
        if not found.possible:
            assert found.rate is None and "eps_x >=" in found.reason
            continue
        scan = np.geomspace(epsilon_x * (1 + 1e-9), ceiling, 200)
        solves = [rate <= T(d, f, beta, rate) for rate in scan]
        if found.rate is None:
            assert not any(solves) and "no lambda > eps_x" in found.reason
            seen["none"] += 1
            continue
        largest = found.rate
        assert epsilon_x < largest <= ceiling
        assert largest == pytest.approx(T(d, f, beta, largest), rel=1e-9)
        assert not any(solved for rate, solved in zip(scan, solves, strict=True) if rate > largest)
        seen["ceiling" if largest == ceiling else "inner"] += 1
    assert min(seen.values()) >= 5, seen


@pytest.mark.parametrize("f", READINGS, ids=["printed", "corrected"])
def test_the_iteration_of_the_errata_falls_to_the_same_lambda(f):
    """lambda <- T(lambda) from above: slower, and it needs no convexity."""
    rng = np.random.default_rng(1)
    settled = 0
    for _ in range(150):
        d, beta = tight_design(rng, f)
        found = decay(d, f, beta)
        if not found.possible:
            continue
        rate, last = found.ceiling, np.inf
        while found.epsilon_x * (1 + 1e-9) < rate < last * (1 - 1e-13):
            last, rate = rate, T(d, f, beta, rate)
        if found.rate is None:
            assert rate <= found.epsilon_x * (1 + 1e-9)
        else:
            assert rate == pytest.approx(found.rate, rel=1e-6)
            settled += 1
    assert settled >= 30


def test_what_lambda_must_not_exceed_is_convex_in_it():
    """The proof of the method: lambda - g(lambda) lies below its chords."""
    rng = np.random.default_rng(2)
    for _ in range(300):
        f = READINGS[rng.integers(2)]
        d, _ = tight_design(rng, f)
        left, right = f.epsilon_x(d) * (1 + np.sort(rng.exponential(3.0, 2)) + 1e-6)
        share = rng.uniform()
        middle = share * left + (1 - share) * right
        loads = [needed(d, V_u(d, f, np.sqrt(f.epsilon_x(d) / x))) for x in (left, middle, right)]
        assert loads[1] <= (share * loads[0] + (1 - share) * loads[2]) * (1 + 1e-12)
