"""A recording plays like the ring of a host that goes where it is sent."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import alight
from alight.live.replay import ReplaySource
from alight.simulation.recording_events import Event, EventKind
from tests.recordings import small

ROWS = 100


class Time:
    """A clock that stands until it is told."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock():
    return Time()


@pytest.fixture
def source(clock):
    return ReplaySource(small(ROWS), clock)


def test_it_stands_at_its_beginning_until_it_plays(source, clock):
    clock.now = 10.0
    assert (source.head, source.playing) == (0, False)
    assert len(source.read(0)[1]) == 0


@pytest.mark.parametrize("speed", [0.5, 1.0, 4.0])
def test_it_plays_at_its_speed_and_stops_at_its_end(source, clock, speed):
    source.speed = speed
    source.play()
    clock.now = (10.5 / 2000) / speed
    assert (source.head, source.playing) == (10, True)
    clock.now = 60.0
    assert (source.head, source.playing) == (ROWS, False)
    source.play()
    assert (source.head, source.playing) == (0, True)


def test_a_pause_keeps_its_place_and_a_change_of_speed_does_not_jump(source, clock):
    source.play()
    clock.now = 20.5 / 2000
    source.pause()
    clock.now = 1.0
    assert source.head == 20
    source.play()
    source.speed = 0.1
    assert source.head == 20
    clock.now += 105 / 2000
    assert source.head == 30


@given(st.integers(-50, 150))
def test_it_goes_where_it_is_sent(row):
    source = ReplaySource(small(ROWS), Time())
    source.seek(row)
    assert source.head == min(max(row, 0), ROWS)
    assert not source.playing


@given(st.integers(0, 120), st.integers(0, 120), st.integers(1, 120) | st.none())
def test_it_reads_what_the_recording_holds_up_to_the_head(head, first, most):
    recording = small(ROWS)
    source = ReplaySource(recording, Time())
    source.seek(head)
    at, rows = source.read(first, most)
    end = min(source.head, first + (ROWS if most is None else most))
    assert at == first
    assert len(rows) == max(end - first, 0)
    assert source.layout.columns == ("t", *recording.columns)
    assert np.array_equal(rows[:, 0], recording.t[first:end])
    assert np.array_equal(rows[:, 1:], recording.samples[first:end])


def test_rows_that_were_lost_are_passed_over_as_in_a_ring(clock):
    """And so are those before the beginning of a part."""
    whole = small(ROWS)
    kept = np.r_[10:40, 60:100]
    source = ReplaySource(dataclasses.replace(whole, t=whole.t[kept], samples=whole.samples[kept]))
    assert (source.first, source.rows) == (10, 100)
    source.seek(100)
    found, at = [], 0
    while len(rows := source.read(at, 16)[1]):
        at = source.read(at, 16)[0]
        found += range(at, at + len(rows))
        assert np.array_equal(rows[:, 1:], whole.samples[at : at + len(rows)])
        at += len(rows)
    assert found == kept.tolist()


def test_it_knows_what_was_in_force_at_each_row():
    changed = [
        Event(0, 0.0, EventKind.START, ""),
        Event(10, 5e-3, EventKind.GAINS, "", 2, changes={"law.gains.k1": 1.0}),
        Event(20, 1e-2, EventKind.REFUSED, "", 3, changes={"law.gains.k1": 9.0}),
        Event(30, 1.5e-2, EventKind.LAW, "", 4, "unsaturated", changes={"law.gains.k2": 2.0}),
        Event(40, 2e-2, EventKind.TARGET, "", 5, changes={"law.gains.k1": 3.0}),
    ]
    scenario = {"law": {"type": "force-limiting"}}
    source = ReplaySource(small(ROWS, events=tuple(changed), scenario=scenario))
    assert [source.law_at(row) for row in (0, 29, 30)] == ["force-limiting"] * 2 + ["unsaturated"]
    assert source.changes_at(9) == {}
    assert source.changes_at(29) == {"law.gains.k1": 1.0}
    assert source.changes_at(50) == {"law.gains.k1": 3.0, "law.gains.k2": 2.0}
    assert source.events(25) == changed[3:]


@pytest.mark.parametrize("suffix", ["parquet", "mcap"])
@pytest.mark.parametrize("every", [1, 10])
def test_a_recording_of_alight_run_plays_too(tmp_path, suffix, every):
    recorded = alight.simulate("experiment-1", every=every, backend="vm")
    path = tmp_path / f"run.{suffix}"
    recorded.save(path)
    source = ReplaySource(path)
    assert source.dt == pytest.approx(every / 2000)
    assert source.rows == len(recorded)
    assert source.scenario.name == "experiment-1"
    source.seek(source.rows)
    _, rows = source.read(0)
    assert np.array_equal(rows[:, 1:], recorded.samples)
