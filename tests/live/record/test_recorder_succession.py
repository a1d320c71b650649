"""Recorders that follow one another: the next goes on where the last one stood."""

from __future__ import annotations

import shutil

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from alight import Outcome, Recording
from alight.live.shared.commands import Kind
from tests.live.record.desk import Desk, kinds, run


@pytest.mark.parametrize("unsaved", [0, 30])
@pytest.mark.parametrize("between", [1, 10, 250])
def test_another_recorder_goes_on_without_a_gap(desk, unsaved, between):
    """However much the first one took without saving it."""
    first = run(desk, 100)
    desk.record()
    desk.gains(k2=0.5)
    desk.tick(unsaved)
    desk.recorder._saved = np.inf
    desk.recorder.step()
    desk.tick(between)
    desk.recorder = desk.another()
    desk.record()
    desk.tick(25)
    desk.ask(Kind.STOP)
    desk.tick(5)
    last = len(desk.rows)
    desk.ask(Kind.RESET)
    desk.tick(5)
    desk.record()
    assert len(desk.files) == 2
    recording = desk.load()
    desk.assert_holds(recording, first, last)
    assert kinds(recording) == ["start", "gains", "stop"]
    assert recording.verdict.outcome is Outcome.STOPPED


def test_recorders_that_die_before_they_say_where_they_stand_leave_no_gap(desk):
    """Each finds the files of those before it, and none of them in the report."""
    first = run(desk, 100)
    desk.record()
    report = (desk.session.folder / "recorder.json").read_bytes()
    for _ in range(3):
        desk.tick(40)
        desk.recorder = desk.another()
        desk.record()
        (desk.session.folder / "recorder.json").write_bytes(report)
    empty = desk.files[0].with_name(f"{desk.files[0].stem}.part5.mcap")
    empty.write_bytes(b"")
    desk.recorder = desk.another()
    desk.tick(10)
    desk.record()
    assert len(desk.files) == 6
    desk.assert_holds(desk.load(), first, len(desk.rows))


def test_a_part_by_itself_says_where_its_beginning_is(desk):
    first = run(desk, 100)
    desk.record()
    desk.recorder = desk.another()
    desk.tick(50)
    desk.record()
    begun, part = desk.files
    recording = Recording.load(part)
    row = recording.bench["continues"]["row"]
    assert recording.bench["continues"]["file"] == begun.name
    desk.assert_holds(recording, first + row, first + 150)


@settings(max_examples=12)
@given(
    st.lists(
        st.tuples(st.integers(1, 60), st.sampled_from(["take", "save", "kill"])),
        min_size=1,
        max_size=12,
    )
)
def test_whenever_recorders_are_killed_the_recording_is_whole(tmp_path_factory, story):
    desk = Desk(tmp_path_factory.mktemp("story"))
    desk.ask(Kind.START)
    for ticks, what in story:
        desk.tick(ticks)
        desk.ask(Kind.KICK, 0, [0.5, 0.0, 0.005])
        if what == "kill":
            desk.recorder = desk.another()
        else:
            desk.recorder._saved = -np.inf if what == "save" else np.inf
            desk.recorder.step()
    desk.ask(Kind.STOP)
    desk.tick(3)
    last = len(desk.rows)
    desk.ask(Kind.RESET)
    desk.tick(1)
    desk.record()
    recording = desk.load()
    desk.assert_holds(recording, 0, last)
    assert [event.number for event in recording.events] == list(range(1, len(story) + 3))


def test_a_stop_and_a_reset_between_two_ticks_are_no_death_of_the_host(desk):
    first = run(desk, 50)
    desk.ask(Kind.STOP)
    desk.ask(Kind.RESET)
    desk.tick(1)
    desk.record()
    recording = desk.load()
    desk.assert_holds(recording, first, first + 50)
    assert recording.verdict.outcome is Outcome.STOPPED
    assert kinds(recording) == ["start"]


def test_a_foreign_file_under_the_name_of_a_part_is_not_joined(desk):
    run(desk, 100)
    desk.record()
    (path,) = desk.files
    other = path.with_name(f"{path.stem}.part2.mcap")
    shutil.copy(path, other)
    assert len(Recording.load(path)) == 100


def test_without_a_report_another_recorder_takes_what_the_ring_holds(desk):
    first = run(desk, 100)
    (desk.session.folder / "recorder.json").unlink()
    desk.recorder = desk.another()
    desk.record()
    desk.assert_holds(desk.load(), first, len(desk.rows))


def test_a_dead_host_ends_the_file_and_the_next_host_begins_another(desk):
    first = run(desk, 120)
    desk.end(alive=False)
    recording = desk.load()
    desk.assert_holds(recording, first, first + 120)
    assert recording.verdict.outcome is Outcome.CUT_OFF
    assert kinds(recording) == ["start", "host lost"]
    assert recording.events[-1].row == 120
    desk.made.begin()
    desk.host()
    desk.recorder = desk.another()
    run(desk, 60)
    desk.end(alive=False)
    assert sorted(len(Recording.load(path)) for path in desk.files) == [60, 120]


@pytest.mark.parametrize("stopped", [True, False])
def test_a_host_that_died_while_no_recorder_was_there(desk, stopped):
    """The recorder that comes after both has nothing new to read, and still ends the file well."""
    first = run(desk, 120)
    if stopped:
        desk.ask(Kind.STOP)
        desk.tick(10)
    desk.record()
    desk.recorder = desk.another()
    desk.end(alive=False)
    recording = desk.load()
    desk.assert_holds(recording, first, len(desk.rows))
    outcome = Outcome.STOPPED if stopped else Outcome.CUT_OFF
    assert recording.verdict.outcome is outcome
    assert recording.verdict.time == recording.t[120 if stopped else 119]
    assert kinds(recording) == ["start", "stop" if stopped else "host lost"]
