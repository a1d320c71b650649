"""Quotients, roots and turned angles: errors within what ``tick_math.h`` states."""

from __future__ import annotations

import re
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from mpmath import mp

from tests.compiler import NEEDS_COMPILER
from tests.kernels.lanes.drivers import RUNS, WIDTHS, call, driver, header, library, same

pytestmark = NEEDS_COMPILER

EVERY_WIDTH = pytest.mark.parametrize("width", WIDTHS)
STATED = {
    name: float(ulps)
    for names, ulps in re.findall(r"^ +([a-z_, ]+?) +([\d.]+) ulp ", header("tick_math.h"), re.M)
    for name in names.split(", ")
}
"""Greatest errors, as the header states them [ulp]."""
BODIES = {
    "inv": ["out[0] = v_inv(x[0]);"],
    "div": ["out[0] = v_div(x[0], x[1]);"],
    "root": ["out[0] = v_root(x[0]);"],
    "sincos": ["v_sincos(x[0], out, out + 1);"],
    "turned": [
        "V s, c;",
        "v_sincos(x[0], &s, &c);",
        "v_sincos_turned(x[0] + x[1], s, c, x[1], out, out + 1);",
    ],
}
TURN = 1 / 64
"""Where a turn is no longer small [rad]."""


@cache
def source() -> str:
    return driver(BODIES)


def result(name: str, width: int, *x: np.ndarray) -> np.ndarray:
    nothing = np.zeros((1, len(x[0])))
    outputs = 2 if name in ("sincos", "turned") else 1
    return call(library(source(), width), name, width, np.array(x), nothing, outputs)


def scales(count: int = 1600, seed: int = 0) -> np.ndarray:
    """Numbers of both signs and of every size that the header allows."""
    rng = np.random.default_rng(seed)
    size = 10.0 ** rng.uniform(-280, 280, count)
    return np.concatenate([rng.choice([-1.0, 1.0], count) * size, rng.uniform(1, 4, count)])


def worst(got: np.ndarray, exact: list, unit: float | None = None) -> float:
    """Greatest error, in the spacing of doubles at the exact result or in a given unit."""
    units = np.spacing(np.abs([float(v) for v in exact])) if unit is None else [unit] * len(exact)
    return max(
        float(abs(mp.mpf(float(g)) - v) / mp.mpf(float(u)))
        for g, v, u in zip(got, exact, units, strict=True)
    )


def of(function, *x: np.ndarray) -> list:
    with mp.workdps(40):
        return [+function(*map(mp.mpf, map(float, row))) for row in zip(*x, strict=True)]


@EVERY_WIDTH
def test_reciprocals_quotients_and_roots_are_as_exact_as_stated(width):
    with mp.workdps(40):
        a, b = scales(), np.random.default_rng(1).permutation(scales(seed=2))
        fits = abs(np.log10(abs(a)) - np.log10(abs(b))) < 280
        a, b = a[fits], b[fits]
        a, b = a[: len(a) // 8 * 8], b[: len(a) // 8 * 8]
        assert worst(result("inv", width, a)[0], of(lambda v: 1 / v, a)) <= STATED["inv"]
        assert worst(result("div", width, a, b)[0], of(lambda v, w: v / w, a, b)) <= STATED["div"]
        assert worst(result("root", width, abs(a))[0], of(mp.sqrt, abs(a))) <= STATED["root"]


@EVERY_WIDTH
def test_turned_angles_are_those_of_the_sum_whether_the_turn_is_small_or_not(width):
    rng = np.random.default_rng(3)
    base = rng.uniform(-50, 50, 1600)
    small = rng.uniform(-TURN, TURN, 1600) * 10.0 ** rng.uniform(-8, 0, 1600)
    edge = rng.choice([-TURN, TURN], 1600) * rng.choice([1 - 1e-15, 1.0, 1 + 1e-15], 1600)
    with mp.workdps(40):
        for turn in (small, edge):
            # Only sums without a rounding tell the error of the angle from that of the sum.
            exact = turn - ((base + turn) - base) == 0
            whole = np.where(exact, turn, (base + turn) - base)
            far = np.concatenate([base, base + whole])
            assert np.isfinite(far).all()
            s, c = result("turned", width, base, whole)
            sum_ = of(lambda a, b: a + b, base, whole)
            assert worst(s, [mp.sin(v) for v in sum_], 2.0**-52) <= STATED["sincos_turned"]
            assert worst(c, [mp.cos(v) for v in sum_], 2.0**-52) <= STATED["sincos_turned"]


@EVERY_WIDTH
@given(
    base=arrays(np.float64, RUNS, elements=st.floats(-1e3, 1e3)),
    turn=arrays(np.float64, RUNS, elements=st.floats(-1e3, 1e3).filter(lambda v: abs(v) > TURN)),
    small=st.lists(st.booleans(), min_size=RUNS, max_size=RUNS),
)
def test_a_large_turn_in_a_lane_gives_the_plain_sine_there_and_changes_no_other(
    width, base, turn, small
):
    mixed = np.where(small, turn * (TURN / 2e3), turn)
    together = result("turned", width, base, mixed)
    plain = result("sincos", width, base + mixed)
    alone = [
        result("turned", width, np.full(RUNS, b), np.full(RUNS, t))[:, 0]
        for b, t in zip(base, mixed, strict=True)
    ]
    assert same(together, np.array(alone).T)
    far = ~np.array(small)
    assert same(together[:, far], plain[:, far])


SPECIAL = np.array([0.0, -0.0, np.inf, -np.inf, np.nan, -1.0, 1.0, 4.0])


@EVERY_WIDTH
def test_zero_infinity_and_nan_are_as_documented(width):
    with np.errstate(all="ignore"):
        exact = {"root": np.sqrt(SPECIAL), "inv": 1 / SPECIAL}
    for name, expected in exact.items():
        got = result(name, width, SPECIAL)[0]
        known = np.isfinite(expected) & np.isfinite(SPECIAL)
        assert np.all(got[known] == expected[known])
        strange = ~known
        assert np.all(np.isnan(got[strange]) | (got[strange] == expected[strange]))
    assert np.all(result("div", width, np.zeros(RUNS), np.full(RUNS, -3.0)) == 0)
    turned = result("turned", width, SPECIAL, np.full(RUNS, 0.001))
    assert np.isnan(turned[:, 2:5]).all() and np.isfinite(turned[:, [0, 1, 5, 6, 7]]).all()
    assert np.isnan(result("turned", width, np.ones(RUNS), np.full(RUNS, np.nan))).all()
