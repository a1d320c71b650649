"""Too late, no room, no folder: nothing is lost without a word."""

from __future__ import annotations

import resource
import shutil

import numpy as np
import pytest

from alight import Recording
from alight.live.shared.commands import Kind
from alight.simulation.recording_events import EventKind
from tests.live.record.desk import Desk, kinds, run


@pytest.fixture
def tight(tmp_path):
    """A desk whose ring keeps little."""
    made = Desk(tmp_path, capacity=500)
    yield made
    made.close()


def test_rows_that_left_the_ring_are_counted_and_said(tight):
    desk = tight
    run(desk, 100)
    desk.record()
    desk.tick(800)
    desk.record()
    recording, dt = desk.load(), desk.bank.loops[0].dt
    (lost,) = (event for event in recording.events if event.kind == EventKind.ROWS_LOST)
    steps = np.rint(np.diff(recording.t) / dt)
    gap = np.flatnonzero(steps != 1)
    assert lost.row == 100 and lost.values == (steps[gap].item() - 1,)
    assert gap == [99] and desk.report["lost"] == lost.values[0]
    assert len(recording) + lost.values[0] == 900
    kept = np.array(desk.rows[20:])[np.rint(recording.t / dt).astype(int)]
    np.testing.assert_array_equal(recording.samples, kept[:, 1:])


def test_a_run_whose_end_left_the_ring_does_not_go_on_in_the_next_one(tight):
    desk = tight
    run(desk, 100)
    desk.record()
    desk.ask(Kind.STOP)
    desk.tick(300)
    desk.ask(Kind.RESET)
    desk.tick(600)
    first = run(desk, 200)
    desk.record()
    found = {len(Recording.load(path)): Recording.load(path) for path in desk.files}
    assert sorted(found) == [100, 200]
    assert found[100].verdict.cause == "its end was lost"
    assert kinds(found[100]) == ["start", "rows lost"]
    desk.assert_holds(found[200], first, first + 200)


@pytest.fixture
def no_room():
    """Sets the size at which files can no longer grow; None for as large as before."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)

    def limit(size: int | None) -> None:
        soft = before[0] if size is None else size
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, before[1]))

    yield limit
    limit(None)


@pytest.mark.parametrize("spare", [0, 100, 5000])
def test_without_room_it_says_so_and_goes_on_when_there_is_some(desk, no_room, spare):
    first = run(desk, 100)
    desk.record()
    (path,) = desk.files
    no_room(path.stat().st_size + spare)
    desk.tick(500)
    desk.record()
    failed = desk.report
    no_room(None)
    assert failed["state"] == "failed"
    assert str(path) in failed["problem"] or str(desk.recordings) in failed["problem"]
    assert "cannot be written" in failed["problem"]
    desk.assert_holds(Recording.load(path), first, first + 100)
    desk.recorder._tried = -np.inf
    desk.tick(10)
    desk.record()
    assert desk.report["state"] == "recording" and not desk.report["problem"]
    assert desk.report["lost"] == 0
    desk.assert_holds(desk.load(), first, len(desk.rows))


@pytest.mark.parametrize("what", ["folder", "file"])
def test_if_folder_or_file_is_taken_away_what_the_ring_holds_makes_another(desk, what):
    first = run(desk, 100)
    desk.record()
    shutil.rmtree(desk.recordings) if what == "folder" else desk.files[0].unlink()
    desk.tick(50)
    desk.record()
    assert desk.report["state"] == "failed" and "cannot be written" in desk.report["problem"]
    desk.recorder._tried = -np.inf
    desk.record()
    assert desk.report["state"] == "recording"
    desk.assert_holds(desk.load(), first, len(desk.rows))


def test_a_folder_that_cannot_be_made_is_a_problem_until_it_can(desk):
    desk.recordings.write_text("a file")
    first = run(desk, 100)
    desk.record()
    assert desk.report["state"] == "failed" and desk.report["rows"] == 0
    desk.recordings.unlink()
    desk.recorder._tried = -np.inf
    desk.record()
    desk.assert_holds(desk.load(), first, len(desk.rows))
