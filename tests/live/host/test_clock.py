"""The host's clock keeps to its grid, and accounts for every deadline."""

from __future__ import annotations

import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from alight.live.host.clock import Budget, Clock, Keeping
from alight.live.shared.status import EDGES, create_status

PERIOD = 2e-3


@pytest.mark.parametrize("spin", [0.0, 5e-4])
def test_every_deadline_is_kept_or_counted_as_missed_whatever_a_tick_takes(spin):
    """However loaded the machine is, deadlines stand on one grid, and ticks never come early."""
    clock = Clock(PERIOD, spin)
    begun, missed = [], []
    for work in (0.0, 0.3, 0.9, 1.5, 0.0, 4.2, 0.0, 0.0, 2.01, 0.5) * 4:
        now = clock.wait()
        assert clock.late >= 0
        begun.append(now - clock.late)
        missed.append(clock.missed)
        time.sleep(work * PERIOD)
    periods = np.diff(begun) / PERIOD
    np.testing.assert_allclose(periods, np.round(periods), atol=1e-6)
    np.testing.assert_array_equal(np.round(periods) - 1, np.diff(missed))
    assert missed[-1] > 0 and (np.round(periods) >= 1).all()


def test_time_that_is_forgiven_is_no_missed_deadline():
    clock = Clock(0.5)
    clock.wait()
    time.sleep(1.1)
    clock.forgive()
    clock.wait()
    assert clock.missed == 0


@given(st.lists(st.tuples(st.floats(0, 2), st.floats(0, 2)), max_size=50))
def test_histograms_count_each_tick_once_and_worst_is_the_largest(tmp_path_factory, ticks):
    status = create_status(tmp_path_factory.mktemp("status") / "status")
    keeping = Keeping(status)
    for late, busy in ticks:
        keeping.note(late, busy)
    for k, name in enumerate(("late", "busy")):
        values = np.array([tick[k] for tick in ticks])
        inside = np.histogram(values, [*EDGES, np.inf])[0]
        np.testing.assert_array_equal(status[f"{name}_counts"], inside)
        assert status[f"worst_{name}"] == max([0.0, *values])


@given(
    steps=st.lists(st.tuples(st.floats(0, 0.7), st.integers(0, 3)), max_size=30),
    most=st.integers(0, 5),
)
def test_the_budget_is_that_of_any_second(steps, most):
    budget, now, missed, all_misses = Budget(most), 0.0, 0, []
    for wait, count in steps:
        now, missed = now + wait, missed + count
        all_misses += [(now, count)] * (count > 0)
        within = sum(n for at, n in all_misses if now - at <= 1.0)
        assert budget.exceeded(now, missed) == (count > 0 and within > most)


def test_a_budget_that_is_renewed_forgets():
    budget = Budget(2)
    assert budget.exceeded(0.0, 3)
    budget.renew(7)
    assert not budget.exceeded(0.1, 9)
    assert budget.exceeded(0.2, 10)
