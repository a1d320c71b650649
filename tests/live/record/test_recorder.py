"""The recorder keeps every row of every run, says so, and another one can go on where it stood."""

from __future__ import annotations

import dataclasses
import json
import resource
import shutil

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from alight import Outcome, Recording
from alight.live.bank import parameter_column
from alight.live.record.place import read_place
from alight.live.shared.commands import Kind
from alight.live.shared.status import State
from alight.simulation.recording_events import EventKind
from tests.live.record.desk import Desk


@pytest.fixture
def desk(tmp_path):
    made = Desk(tmp_path)
    yield made
    made.close()


def run(desk: Desk, count: int = 300) -> int:
    """Some rows, a start, more rows; number of the first of the run."""
    desk.tick(20)
    first = len(desk.rows)
    assert desk.ask(Kind.START) == ""
    desk.tick(count)
    return first


def kinds(recording: Recording) -> list[str]:
    return [str(event.kind) for event in recording.events]


# What is kept


def test_a_run_is_kept_from_its_first_row_to_the_one_before_the_reset(desk):
    first = run(desk)
    desk.ask(Kind.STOP)
    desk.tick(50)
    last = len(desk.rows)
    desk.ask(Kind.RESET)
    desk.tick(30)
    desk.record()
    recording = desk.load()
    desk.assert_holds(recording, first, last)
    assert recording.verdict.outcome is Outcome.STOPPED
    assert recording.verdict.time == recording.t[300]
    assert kinds(recording) == ["start", "stop"]
    assert [event.row for event in recording.events] == [0, 300]
    assert desk.report["state"] == "idle"


def test_without_a_reset_it_ends_two_seconds_after_the_torque_went(desk):
    first = run(desk)
    desk.ask(Kind.STOP)
    desk.tick(5000)
    desk.record()
    desk.assert_holds(desk.load(), first, first + 300 + 4000)


def test_each_run_has_a_file_of_its_own_and_none_is_overwritten(desk):
    for count in (50, 60, 70):
        run(desk, count)
        desk.ask(Kind.STOP)
        desk.ask(Kind.RESET)
        desk.tick(1)
        desk.record()
    lengths = sorted(len(Recording.load(path)) for path in desk.files)
    assert lengths == [50, 60, 70]


def test_runs_that_are_taken_in_one_batch_are_told_apart(desk):
    first = []
    for count in (50, 60, 70):
        first.append(run(desk, count))
        desk.ask(Kind.STOP)
        desk.tick(1)
        desk.ask(Kind.RESET)
        desk.tick(1)
    desk.record()
    found = sorted((Recording.load(path) for path in desk.files), key=len)
    for begin, count, recording in zip(first, (51, 61, 71), found, strict=True):
        desk.assert_holds(recording, begin, begin + count)
        assert kinds(recording) == ["start", "stop"]


def test_every_change_by_hand_is_an_event_with_the_first_row_that_shows_it(desk):
    first = run(desk, 100)
    column = parameter_column(desk.bank.loops[0])
    unsaturated = desk.bank.number_of["unsaturated"]
    desk.gains(k2=0.5)
    desk.tick(10)
    desk.ask(Kind.KICK, 0, [3.0, -1.0, 0.005])
    desk.tick(20)
    desk.ask(Kind.START)
    desk.tick(5)
    desk.ask(Kind.LAW, unsaturated, parameter_column(desk.bank.loops[unsaturated]))
    desk.tick(10)
    desk.ask(Kind.LAW, 0, column)
    desk.ask(Kind.PARAMETERS, 0, column, **{"law.target.x_md": 0.33})
    desk.tick(10)
    desk.ask(Kind.STOP)
    desk.tick(10)
    desk.record()
    events = desk.load().events
    assert [event.kind for event in events] == [
        EventKind.START,
        EventKind.GAINS,
        EventKind.KICK,
        EventKind.REFUSED,
        EventKind.LAW,
        EventKind.LAW,
        EventKind.TARGET,
        EventKind.STOP,
    ]
    assert [event.row for event in events] == [0, 100, 110, 130, 135, 145, 145, 155]
    assert [event.number for event in events] == list(range(1, 9))
    assert events[1].changes == {"law.gains.k2": 0.5}
    assert "k2 = 0.5, by test" in events[1].text
    assert events[2].values == (3.0, -1.0, 0.005)
    assert "RUNNING: reset it first" in events[3].text
    assert [events[4].law, events[5].law] == ["unsaturated", desk.bank.names[0]]
    rows = np.array(desk.rows[first:])
    shown = rows[:, desk.link.layout.slices()["command"].start]
    for event in events:
        assert np.argmax(shown >= event.number) == event.row


def test_the_scenario_of_a_recording_is_that_in_force_at_its_start(desk):
    desk.gains(k2=0.25)
    desk.tick(3)
    run(desk)
    desk.gains(k2=0.75)
    desk.tick(10)
    desk.ask(Kind.STOP)
    desk.tick(1)
    desk.record()
    recording = desk.load()
    assert recording.scenario["law"]["gains"]["k2"] == 0.25
    assert recording.scenario["seed"] == desk.settings.seed
    assert not any(path.startswith("law.gains.k2") for path in recording.scenario["provenance"])
    assert kinds(recording) == ["start", "gains", "stop"]


def test_a_trip_is_an_event_with_the_words_of_the_host(desk):
    first = run(desk, 50)
    desk.cycle.trip(204, "more than 7 deadlines were missed within a second")
    desk.tick(5000)
    desk.record()
    recording = desk.load()
    desk.assert_holds(recording, first, first + 50 + 4000)
    assert recording.verdict.outcome is Outcome.HALTED
    (trip,) = (event for event in recording.events if event.kind == EventKind.TRIP)
    assert (trip.row, trip.values) == (50, (204.0,))
    assert trip.text == recording.verdict.cause == desk.cycle.reason


def test_other_programs_read_samples_and_events_from_an_unfinished_file(desk):
    run(desk, 100)
    desk.gains(k2=0.5)
    desk.tick(20)
    desk.record()
    from mcap.stream_reader import StreamReader

    (path,) = desk.files
    with path.open("rb") as file:
        names = [type(record).__name__ for record in _until_the_end(StreamReader(file))]
    assert names.count("Message") == 120 + 2
    desk.ask(Kind.STOP)
    desk.tick(5000)
    desk.record()
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        decoded = [m.decoded_message for m in reader.iter_decoded_messages(topics=["/recording"])]
        told = [json.loads(m.data) for _, _, m in reader.iter_messages(topics=["/events"])]
    recording = desk.load()
    np.testing.assert_array_equal([m.q1 for m in decoded], recording["q1"])
    assert [event["text"] for event in told] == [event.text for event in recording.events]


def _until_the_end(reader):
    from mcap.exceptions import EndOfFile

    try:
        yield from reader.records
    except EndOfFile:
        return


# Recorders that follow one another


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


# Too late, no room, no folder


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


# What it says of itself


def test_the_report_tells_file_length_and_place(desk):
    assert desk.report["state"] == "idle" and desk.report["file"] is None
    run(desk, 100)
    desk.record()
    report = desk.report
    (path,) = desk.files
    assert (report["state"], report["file"]) == ("recording", str(path))
    assert report["bytes"] == path.stat().st_size
    assert report["rows"] == 100
    assert report["seconds"] == pytest.approx(100 * desk.bank.loops[0].dt)
    place = read_place(desk.session.folder)
    assert place.row == len(desk.rows) and place.run.first == 20


def test_a_damaged_report_is_as_good_as_none(desk):
    (desk.session.folder / "recorder.json").write_text('{"place": {"host": 3}}')
    assert read_place(desk.session.folder) is None
    (desk.session.folder / "recorder.json").write_text('{"pla')
    assert read_place(desk.session.folder) is None


def test_what_happens_while_the_bench_stands_makes_no_file(desk):
    desk.gains(k2=0.5)
    desk.tick(100)
    desk.ask(Kind.STOP)
    desk.ask(Kind.KICK, 0, [1.0, 1.0, 1.0])
    desk.tick(100)
    desk.record()
    assert desk.files == []
    assert desk.cycle.state is State.READY


def test_the_recorder_does_not_care_who_owns_the_name(desk):
    """A scenario's name may hold what no file name can."""
    opened = {**desk.settings.scenario, "name": "../a b/c"}
    settings = dataclasses.replace(desk.settings, scenario=opened)
    desk.session = dataclasses.replace(desk.session, settings=settings)
    desk.recorder = desk.another()
    run(desk, 10)
    desk.record()
    (path,) = desk.files
    assert path.name.startswith("..-a-b-c-") and path.parent == desk.recordings
