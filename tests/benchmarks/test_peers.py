"""Every peer solves the problem of the benchmark, or its figures would mean nothing."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import alight
from alight_benchmarks.generated import NoCompiler
from alight_benchmarks.peer import RECORD_EVERY, Peer, Problem, varied
from alight_benchmarks.peers import ALL
from alight_benchmarks.peers.numpy_loop import PEERS as NUMPY

PROBLEM = Problem.load(0.3)
"""Long enough for several impacts, the first at about 0.055 s."""
FREE = PROBLEM.times < 0.05
STRADDLING = 1e-5
"""What plain steps that straddle a switch of contact cost in that time [rad, m]."""


@cache
def simulated() -> np.ndarray:
    """Return what Alight gives where the peers record."""
    recording = alight.simulate(PROBLEM.scenario, channels=("q", "x_m"), backend="vm")
    return np.column_stack([recording["q"], recording["x_m"]])[::RECORD_EVERY]


@cache
def straightforward() -> np.ndarray:
    """Return what the plainest peer gives."""
    return NUMPY[0].prepare(PROBLEM)()


@cache
def continuous() -> np.ndarray:
    """Return the continuous closed loop by Alight's reference."""
    scenario = PROBLEM.scenario
    found = alight.reference(scenario.closed_loop, scenario.start, PROBLEM.times).recording
    return np.column_stack([found["q"], found["x_m"]])


def error(rows: np.ndarray, expected: np.ndarray) -> float:
    """Largest difference of any angle [rad] or position [m]."""
    assert rows.shape == expected.shape
    return float(np.abs(rows - expected).max())


def test_formulas_typed_by_hand_are_those_of_alight_in_free_motion():
    assert error(straightforward()[FREE], simulated()[FREE]) < 1e-12


def test_through_impacts_they_differ_by_steps_that_straddle_the_switch():
    assert error(straightforward(), simulated()) < STRADDLING


def test_a_thousandth_of_the_contact_stiffness_would_show():
    n = PROBLEM.numbers
    stiffer = replace(PROBLEM, numbers=replace(n, K_I=1.001 * n.K_I))
    assert error(NUMPY[0].prepare(stiffer)(), simulated()) > 20 * STRADDLING


@pytest.mark.parametrize("peer", ALL, ids=lambda peer: peer.name)
def test_peer_solves_the_problem(peer: Peer):
    if peer.version is None:
        pytest.skip(f"{peer.package} is not installed; it comes with the extra bench")
    try:
        rows = peer.prepare(PROBLEM)()
    except NoCompiler as missing:
        pytest.skip(str(missing))
    assert error(rows, continuous() if peer.continuous else straightforward()) < peer.tolerance


def test_names_of_peers_are_distinct():
    assert len({peer.name for peer in ALL}) == len(ALL)


def test_first_run_of_a_batch_is_the_nominal_one_and_the_others_vary():
    n, many = PROBLEM.numbers, varied(PROBLEM.numbers, 64)
    for name in ("m", "k_s"):
        share = getattr(many, name) / getattr(n, name)
        assert share[0] == 1.0
        assert (np.abs(share[1:] - 1) <= 0.1).all()
        assert len(np.unique(share)) == 64
