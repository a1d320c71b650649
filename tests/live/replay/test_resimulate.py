"""What was done to a simulated bench reproduces its recording to the bit, without a clock."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import alight
from alight import Outcome, Recording
from alight.live.bank import parameter_column
from alight.live.cycle import DEADLINES
from alight.live.replay import first_difference, resimulate
from alight.live.replay.resimulate import TIMEKEEPING, NotReproducible
from alight.live.shared.commands import Kind
from alight.simulation.recording_events import EventKind
from tests.cli.command import invoke
from tests.live.cycles import driven
from tests.live.record.desk import Desk

NOISY = ("testbed.transducer.noise=1e-6",)


def recorded(desk: Desk) -> Recording:
    """The recording of a desk whose run is over."""
    desk.ask(Kind.STOP)
    desk.tick(20)
    desk.ask(Kind.RESET)
    desk.tick(1)
    desk.record()
    return desk.load()


def assert_reproduced(recording: Recording) -> None:
    again = resimulate(recording, backend="vm")
    assert first_difference(recording, again) is None
    assert again.layout == recording.layout
    assert again.verdict.outcome is recording.verdict.outcome
    assert again.verdict.time == recording.verdict.time


def busy_run(desk: Desk) -> Recording:
    """A run in which everything is done that a page can ask for."""
    own, other = (parameter_column(loop) for loop in desk.bank.loops[:2])
    desk.gains(alpha1=11.0)
    desk.tick(13)
    desk.ask(Kind.START)
    desk.tick(120)
    desk.gains(alpha1=9.0, k2=0.4)
    desk.tick(60)
    desk.ask(Kind.KICK, 0, [2.0, -0.3, 0.02])
    desk.tick(10)
    assert desk.ask(Kind.RESET) != ""
    desk.ask(Kind.LAW, 1, other)
    desk.tick(70)
    desk.ask(Kind.PARAMETERS, 1, desk.made.changed(1, target__x_md=0.2355))
    desk.ask(Kind.KICK, 0, [-1.0, 0.1, 0.5])
    desk.tick(60)
    desk.ask(Kind.LAW, 0, own)
    desk.tick(40)
    return recorded(desk)


@pytest.mark.parametrize("overrides", [(), (*NOISY, "testbed.delay=true", "seed=5")])
def test_a_busy_run_is_reproduced(tmp_path, overrides):
    recording = busy_run(Desk(tmp_path, driven("experiment-1", *overrides)))
    assert recording.verdict.outcome is Outcome.STOPPED
    assert np.count_nonzero(np.diff(recording["law"])) == 2
    assert_reproduced(recording)


_asked = st.sampled_from(["gains", "kick", "law", "stop", "start", "reset", "nothing"])


@settings(max_examples=8)
@given(st.lists(st.tuples(st.integers(0, 60), _asked), max_size=10))
def test_whatever_is_asked_the_run_is_reproduced(tmp_path_factory, story):
    desk = Desk(tmp_path_factory.mktemp("story"), driven("experiment-1", *NOISY))
    columns = [parameter_column(loop) for loop in desk.bank.loops]
    desk.tick(3)
    desk.ask(Kind.START)
    desk.tick(1)
    for i, (ticks, what) in enumerate(story):
        law = desk.cycle.law
        if what == "gains":
            desk.gains(alpha1=8.0 + i / 7)
        elif what == "kick":
            desk.ask(Kind.KICK, 0, [3.0 * i, -i / 3, 0.01])
        elif what == "law":
            desk.ask(Kind.LAW, (law + 1) % len(columns), columns[(law + 1) % len(columns)])
        elif what in ("stop", "start", "reset"):
            desk.ask(Kind[what.upper()])
        desk.tick(ticks + 1)
    desk.end(alive=False)
    paths = [path for path in desk.files if ".part" not in path.name]
    for recording in map(Recording.load, paths):
        assert_reproduced(recording)


def test_a_trip_of_the_clock_comes_from_its_event_and_every_other_by_itself(tmp_path):
    desk = Desk(tmp_path)
    desk.ask(Kind.START)
    desk.tick(70)
    desk.cycle.trip(DEADLINES, "more than 5 deadlines were missed within a second")
    desk.tick(5)
    desk.ask(Kind.RESET)
    desk.tick(2)
    desk.record()
    recording = desk.load()
    assert recording.verdict.outcome is Outcome.HALTED
    assert_reproduced(recording)
    untold = [event for event in recording.events if event.kind != EventKind.TRIP]
    again = resimulate(dataclasses.replace(recording, events=tuple(untold)), backend="vm")
    difference = first_difference(recording, again)
    assert difference is not None
    assert difference.row == 70


def test_a_trip_of_the_law_is_reproduced_without_its_event(tmp_path):
    desk = Desk(tmp_path)
    desk.ask(Kind.START)
    desk.tick(30)
    desk.gains(alpha1=5000.0)
    desk.tick(400)
    desk.ask(Kind.RESET)
    desk.tick(1)
    desk.record()
    recording = desk.load()
    assert recording.verdict.outcome is Outcome.TRIPPED
    untold = [event for event in recording.events if event.kind != EventKind.TRIP]
    again = resimulate(dataclasses.replace(recording, events=tuple(untold)), backend="vm")
    assert first_difference(recording, again) is None
    assert again.verdict.outcome is Outcome.TRIPPED


@pytest.fixture(scope="module")
def plain(tmp_path_factory) -> Path:
    """A short run without changes."""
    desk = Desk(tmp_path_factory.mktemp("plain"))
    desk.ask(Kind.START)
    desk.tick(120)
    recorded(desk)
    return desk.files[0]


def test_without_changes_it_is_the_simulation_of_its_scenario(plain):
    """The scenario that a recording carries is one that `alight.simulate` runs."""
    recording = Recording.load(plain)
    simulated = alight.simulate("experiment-1", backend="vm")
    running = int(np.argmax(recording["state"] != 1))
    assert running == 120
    for name in ("q1", "x_m", "tau1", "tau2", "e_m", "u_f"):
        assert np.array_equal(recording[name][:running], simulated[name][:running])


def test_only_timekeeping_is_not_compared(plain):
    recording = Recording.load(plain)
    for name in recording.columns:
        samples = recording.samples.copy()
        column = recording.columns.index(name)
        samples[33, column] = np.nextafter(np.nan_to_num(samples[33, column]), np.inf)
        difference = first_difference(recording, dataclasses.replace(recording, samples=samples))
        if name in TIMEKEEPING:
            assert difference is None
        else:
            assert difference is not None
            assert (difference.row, difference.column) == (33, name)
            assert difference.t == recording.t[33]


def without(recording: Recording, rows: slice) -> Recording:
    kept = np.delete(np.arange(len(recording)), rows)
    return dataclasses.replace(recording, t=recording.t[kept], samples=recording.samples[kept])


@pytest.mark.parametrize(
    ("changed", "complaint"),
    [
        (
            lambda r: alight.simulate("experiment-1", every=100, backend="vm"),
            "not made by the live",
        ),
        (lambda r: dataclasses.replace(r, bench={**r.bench, "device": "d.toml"}), "real drives"),
        (lambda r: without(r, slice(0, 7)), "beginning of the run is missing"),
        (lambda r: without(r, slice(50, 60)), "rows are missing after 0.0245 s"),
        (lambda r: without(r, slice(0, None)), "no samples"),
        (lambda r: dataclasses.replace(r, bench={**r.bench, "certain": False}), "every command"),
    ],
)
def test_what_cannot_be_reproduced_is_refused_with_the_reason(plain, changed, complaint):
    with pytest.raises(NotReproducible, match=complaint):
        resimulate(changed(Recording.load(plain)))


def test_the_command_says_whether_it_is_reproduced(plain, tmp_path):
    done = invoke("replay", str(plain), "--check")
    assert done.exit_code == 0, done.output
    assert "reproduced: 140 samples" in done.output
    recording = Recording.load(plain)
    samples = recording.samples.copy()
    samples[77, recording.columns.index("q2")] += 1e-15
    other = tmp_path / "other.parquet"
    dataclasses.replace(recording, samples=samples).save(other)
    done = invoke("replay", str(other), "--check")
    assert done.exit_code == 1
    assert "not reproduced: at 0.0385 s (row 77) q2 was" in done.output


def test_the_command_refuses_what_is_no_recording(tmp_path):
    path = tmp_path / "run.mcap"
    path.write_bytes(b"nothing")
    done = invoke("replay", str(path), "--check")
    assert done.exit_code == 2
    assert "is damaged, or is not an MCAP file" in done.output
