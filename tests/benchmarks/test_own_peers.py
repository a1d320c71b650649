"""A peer that is missing or fails is told of, and takes nothing else with it."""

from __future__ import annotations

import numpy as np
import pytest

from alight_benchmarks.generated import NoCompiler, compiler
from alight_benchmarks.own.bench import Bench
from alight_benchmarks.own.peers import measured
from alight_benchmarks.own.ratios import QUICK
from alight_benchmarks.peer import Peer, Problem
from alight_benchmarks.peers.numpy_loop import PEERS as NUMPY


def bench() -> Bench:
    return Bench(QUICK, ("numpy",), [0], lambda share, what=None: None)


def peer(prepare, package: str = "numpy") -> Peer:
    return Peer("a peer", package, "does something", prepare)


def failing(problem: Problem):
    raise ImportError("its library\nis broken")


def test_a_missing_package_is_named_with_what_to_install():
    found = measured(bench(), peer(failing, "no-such-distribution"))
    assert found == {"missing": "pip install no-such-distribution"}


def test_a_peer_that_fails_says_why():
    assert measured(bench(), peer(failing)) == {"failed": "ImportError: its library is broken"}


def has_compiler() -> bool:
    try:
        return bool(compiler())
    except NoCompiler:
        return False


NEEDS_COMPILER = pytest.mark.skipif(not has_compiler(), reason="no C compiler on this machine")


@NEEDS_COMPILER
def test_the_error_is_that_of_the_rows_it_returned():
    off = 1e-3

    def prepare(problem: Problem):
        run = NUMPY[0].prepare(problem)
        return lambda: run() + [0.0, off, 0.0]

    right, wrong = measured(bench(), NUMPY[0]), measured(bench(), peer(prepare))
    assert right["error"]["q"] < 1e-5
    assert right["same"] and not wrong["same"]
    assert wrong["error"]["q"] == pytest.approx(off, rel=0.01)
    assert wrong["error"]["x_m"] == right["error"]["x_m"]
    assert right["ratio"]["low"] > 1.0  # no Python loop outruns C


@NEEDS_COMPILER
def test_a_peer_that_returns_no_numbers_has_no_error():
    def prepare(problem: Problem):
        return lambda: np.full((len(problem.times), 3), np.nan)

    found = measured(bench(), peer(prepare))
    assert found["error"] == {"q": None, "x_m": None} and not found["same"]
