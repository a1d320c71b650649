"""The recorder keeps every row of every run, and says so."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from alight import Outcome, Recording
from alight.live.bank import parameter_column
from alight.live.record.place import read_place
from alight.live.shared.commands import Kind
from alight.live.shared.status import State
from alight.simulation.recording_events import EventKind
from tests.live.record.desk import kinds, run

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
