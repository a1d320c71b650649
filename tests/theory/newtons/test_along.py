"""Along many random, tightly integrated runs every proven bound holds at every instant.

Bounds that hold an integral are compared up to what halving the samples changes in it; all others
to rounding.
"""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
import pytest

from alight.theory.newtons import Trace, along
from tests.theory.runs import KINDS, Run, random_run

SEEDS = range(20)
MORE_SEEDS = range(SEEDS.stop, 225)
FAR = {"first contact", "u_f", "int r_r1^2"}
"""Bounds that no run comes near; every other one is exceeded somewhere if it is made smaller."""


@functools.cache
def traces(seed: int) -> dict[str, Trace]:
    run = random_run(seed)
    return along(run.case, run.recording, run.switches)


@functools.cache
def slack(seed: int) -> dict[str, float]:
    """What halving the samples changes in the bounds that hold an integral [J]."""
    run, fine = random_run(seed), traces(seed)
    whole = run.recording
    halved = dataclasses.replace(whole, t=whole.t[::2], samples=whole.samples[::2])
    coarse = along(run.case, halved, run.switches)
    changed = {
        name: float(np.abs(fine[name].upper[::2] - coarse[name].upper).max())
        for name in ("V_r", "energy")
    }
    # in the contact F_m^2 / (2 K_I) is what the bound of the energy holds
    changed["F_m from energy"] = changed["energy"]
    return changed


def excess(name: str, trace: Trace, slack: float, run: Run) -> float:
    """By how much a trace leaves its bounds at worst, over the rounding that is admitted."""
    ends = [end for end in (trace.lower, trace.upper) if end is not None]
    if name == "F_m from energy":
        stored = trace.value**2 - trace.upper**2
        return float(stored.max()) / (2 * run.case.plant.contact.K_I) - slack - 1e-9
    rounding = 1e-9 * np.max([np.abs(trace.value), *map(np.abs, ends)], axis=0) + 1e-12
    if name == "F_m":  # K_I times the difference of positions, of about a metre
        rounding = rounding + 1e-12 * run.case.plant.contact.K_I
    over = [] if trace.upper is None else [trace.value - trace.upper - rounding]
    under = [] if trace.lower is None else [trace.lower - trace.value - rounding]
    return float(np.max([*over, *under], initial=-np.inf)) - slack


def assert_bounded(seed: int) -> None:
    run = random_run(seed)
    assert len(run.recording) > 1
    outside = {}
    for name, trace in bounded(seed).items():
        found = excess(name, trace, slack(seed).get(name, 0.0), run)
        if found > 0:
            outside[name] = found
    assert not outside, (run.kind, outside)


def bounded(seed: int) -> dict[str, Trace]:
    """Traces that have a bound."""
    found = traces(seed).items()
    return {name: t for name, t in found if t.lower is not None or t.upper is not None}


@pytest.mark.parametrize("seed", SEEDS)
def test_every_proven_bound_holds_at_every_instant(seed):
    assert_bounded(seed)


@pytest.mark.slow
@pytest.mark.parametrize("seed", MORE_SEEDS)
def test_every_proven_bound_holds_in_many_more_runs(seed):
    assert_bounded(seed)


def test_the_runs_cover_what_the_bounds_speak_of():
    runs = [random_run(seed) for seed in SEEDS]
    assert {run.kind for run in runs} == set(KINDS)
    assert sum(not run.cut for run in runs) >= len(runs) / 2
    assert sum(len(run.switches) >= 2 for run in runs) >= len(runs) / 3
    assert {run.case.s.q[1] > 0 for run in runs} == {True, False}
    counts = {}
    for seed in SEEDS:
        for name in bounded(seed):
            counts[name] = counts.get(name, 0) + 1
    everywhere = set(bounded(0)) - {"V_m in contact"}
    assert all(counts[name] == len(runs) for name in everywhere), counts
    of_a_part = set(counts) - everywhere
    assert of_a_part == {
        "u_f before contact",
        "ahead",
        "speed of approach",
        "first contact",
        "V_m in contact",
    }
    assert min(counts[name] for name in of_a_part) >= 4, counts


def tightened(trace: Trace, share: float) -> Trace:
    """The same with bounds that leave only a share of the room: about their middle, or to zero."""
    if trace.lower is None:
        return dataclasses.replace(trace, upper=share * trace.upper)
    middle, half = (trace.upper + trace.lower) / 2, (trace.upper - trace.lower) / 2
    if not half.any():  # an equality
        return dataclasses.replace(trace, lower=share * trace.lower, upper=share * trace.upper)
    return dataclasses.replace(trace, lower=middle - share * half, upper=middle + share * half)


def test_no_bound_could_be_a_fifth_smaller():
    exceeded = set()
    for seed in SEEDS:
        for name, trace in bounded(seed).items():
            allowed = slack(seed).get(name, 0.0)
            if excess(name, tightened(trace, 0.8), allowed, random_run(seed)) > 0:
                exceeded.add(name)
    assert set().union(*(bounded(seed) for seed in SEEDS)) - exceeded == FAR
