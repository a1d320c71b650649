"""Ratios and their spread, from times that are given."""

from __future__ import annotations

import time
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from alight_benchmarks.own.ratios import QUICK, Kept, Work, compared, ratios, spread

TIMES = st.floats(1e-6, 1e3)


def test_each_sample_is_compared_with_the_base_around_it():
    assert ratios([6.0, 9.0], [1.0, 3.0, 6.0]) == [6.0 / 2.0, 9.0 / 4.5]


def test_each_side_counts_by_the_amount_it_does():
    """A batch of 100 runs in 5 s, where one run of the base takes 2 s, is a fortieth."""
    assert ratios([5.0], [2.0, 2.0], amount=100.0, base=1.0) == [pytest.approx(1 / 40)]


@given(st.lists(TIMES, min_size=1, max_size=9), TIMES, TIMES)
def test_the_speed_of_the_clock_falls_out(samples, base, slower):
    bases = [base] * (len(samples) + 1)
    once = ratios(samples, bases)
    slow = ratios([slower * s for s in samples], [slower * b for b in bases])
    assert slow == pytest.approx(once)


@given(st.lists(st.floats(1.0, 2.0), min_size=2, max_size=9), st.floats(0.5, 8.0))
def test_a_steady_drift_hits_both(bases, factor):
    """What takes a multiple of the base around it has this ratio, however the base drifts."""
    samples = [factor * (a + b) / 2 for a, b in pairwise(bases)]
    assert ratios(samples, bases) == pytest.approx([factor] * len(samples))


@pytest.mark.parametrize(("samples", "bases"), [([], [1.0]), ([1.0], [1.0]), ([1.0], [1.0] * 3)])
def test_samples_without_a_base_on_both_sides_are_refused(samples, bases):
    with pytest.raises(ValueError, match="need one base more"):
        ratios(samples, bases)


@given(st.lists(TIMES, min_size=1))
def test_spread_is_that_of_the_values(values):
    found = spread(values)
    assert found["low"] <= found["median"] <= found["high"]
    assert (found["low"], found["high"]) == (min(values), max(values))
    assert found["count"] == len(values)


def test_samples_are_taken_by_turns():
    calls = []

    def named(name: str, seconds: float):
        def call() -> None:
            calls.append(name)
            time.sleep(seconds)

        return call

    found = compared(Work(named("a", 0.06)), Work(named("b", 0.06)), QUICK)
    assert found["ratio"]["count"] >= 1
    assert found["ratio"]["low"] > 0 and found["seconds"]["low"] >= 0.06
    measured = "".join(calls)[-2 * int(found["ratio"]["count"]) :]
    assert measured == "ab" * int(found["ratio"]["count"])


def test_a_long_first_call_counts_only_if_all_was_prepared():
    for prepared, calls in ((True, 1), (False, 2)):
        kept = Kept(lambda: time.sleep(0.4) or 7)
        count = []
        work = Work(lambda kept=kept, count=count: (kept(), count.append(1)), prepared=prepared)
        compared(work, Work(lambda: time.sleep(0.06)), QUICK)
        assert (len(count), kept.latest) == (calls, 7)
