"""Every process of a bench is killed at random moments, 50 times: each file opens, and is whole.

What counts as a second lost is counted in rows, between the head of the ring when the kill came
and the last row in the file.
"""

from __future__ import annotations

import functools
import os
import re
import signal
import time
from pathlib import Path

import numpy as np
import pytest

from alight import Outcome, Recording
from alight.live.record.place import read_report
from alight.live.session import Link
from alight.live.shared.commands import Kind
from alight.live.shared.status import State
from alight.simulation.recording_events import EventKind
from tests.live.bench import Bench, ask, bench, gather, lives, state_of, supervised, wait_for

pytestmark = pytest.mark.slow

SECOND = 2000
"""Rows."""


def begin(link: Link) -> int:
    """Start a run; number of its first row in the ring."""
    wait_for(lambda: state_of(link) is State.READY)
    return ask(link, Kind.START).tick


def end(made: Bench, link: Link) -> None:
    """Stop and reset, and wait until the recorder has finished its file."""
    ask(link, Kind.STOP)
    row = ask(link, Kind.RESET).tick
    wait_for(lambda: idle(made, row))


def idle(made: Bench, row: int) -> bool:
    """Whether the recorder has nothing to record, up to a row."""
    report = read_report(made.session.folder)
    return bool(report and report["state"] == "idle" and report["place"]["row"] >= row)


def sleep(rng: np.random.Generator, least: float, most: float) -> None:
    time.sleep(rng.uniform(least, most))


def caught_up(made: Bench, link: Link, first: int) -> Path:
    """The file of the run that began at a row, once the recorder has all but the newest rows."""

    def found() -> Path | None:
        report = read_report(made.session.folder)
        if not report or report["pid"] != made.pid("record") or report["state"] != "recording":
            return None
        place = report["place"]
        same = place["host"] == link.folder.name and place["run"]["first"] == first
        return Path(report["file"]) if same and place["row"] > link.ring.head - SECOND else None

    path = wait_for(found)
    return path.with_name(re.sub(r"\.part\d+", "", path.name))


def assert_holds(recording: Recording, link: Link, first: int) -> None:
    """Rows that follow one another from the first on, equal to those of the ring to the bit."""
    n, dt = len(recording), recording.bench["dt"]
    assert recording.t.tobytes() == (np.arange(n) * dt).tobytes()
    at, rows = link.ring.read(first, n)
    kept = at - first
    assert len(rows) + kept == n
    assert recording.samples[kept:].tobytes() == np.ascontiguousarray(rows[:, 1:]).tobytes()
    assert not [e for e in recording.events if e.kind == EventKind.ROWS_LOST]


def test_the_recorder_is_killed_eighteen_times(tmp_path):
    """Each time another one goes on; in the end nothing is missing at all."""
    rng, lost = np.random.default_rng(1), []
    with bench(tmp_path, parts=("host", "record")) as made:
        link = made.link()
        for _ in range(3):
            first = begin(link)
            path = caught_up(made, link, first)
            for _ in range(6):
                sleep(rng, 0.05, 1.0)
                made.kill("record")
                head = link.ring.head
                cut = Recording.load(path)
                assert cut.verdict.outcome is Outcome.CUT_OFF
                assert_holds(cut, link, first)
                lost.append(head - first - len(cut))
                assert lost[-1] <= SECOND
                made.start("record")
                caught_up(made, link, first)
            end(made, link)
            whole = Recording.load(path)
            assert_holds(whole, link, first)
            assert whole.verdict.outcome is Outcome.STOPPED
            assert [event.kind for event in whole.events] == ["start", "stop"]
    print(f"rows not yet in the file at the kill: {sorted(lost)}")


def test_everything_is_killed_at_once_ten_times(tmp_path):
    """As by the end of the power, but for what the disk itself forgets."""
    rng, lost = np.random.default_rng(2), []
    for _ in range(2):
        with bench(tmp_path, parts=("host", "record")) as made:
            for _ in range(5):
                link = wait_for(functools.partial(live_link, made))
                first = begin(link)
                path = caught_up(made, link, first)
                sleep(rng, 0.1, 1.5)
                for part in ("host", "record"):
                    os.kill(made.pid(part), signal.SIGKILL)
                for part in ("host", "record"):
                    made.processes[part].wait()
                cut = Recording.load(path)
                assert cut.verdict.outcome is Outcome.CUT_OFF
                assert_holds(cut, link, first)
                lost.append(link.ring.head - first - len(cut))
                assert lost[-1] <= SECOND
                made.start("host")
                made.start("record")
    print(f"rows not yet in the file at the kill: {sorted(lost)}")


def finished(path: Path) -> Recording | None:
    """A recording, once its end is written, which says that the host died."""
    found = Recording.load(path)
    return found if "host died" in str(found.verdict) else None


def live_link(made: Bench) -> Link | None:
    """The newest host, once it is the one that was started last."""
    hosts = made.session.hosts
    link = Link.open(hosts[-1]) if hosts else None
    return link if link and int(link.status["pid"]) == made.pid("host") else None


def test_the_host_is_killed_ten_times(tmp_path):
    """Its ring outlives it: not one row is lost, and the recording says what happened."""
    rng = np.random.default_rng(3)
    with bench(tmp_path, parts=("host", "record")) as made:
        for _ in range(10):
            link = wait_for(functools.partial(live_link, made))
            first = begin(link)
            path = caught_up(made, link, first)
            sleep(rng, 0.0, 1.0)
            made.kill("host")
            made.start("host")
            recording = wait_for(functools.partial(finished, path))
            assert len(recording) == link.ring.head - first
            assert_holds(recording, link, first)
            assert recording.verdict.outcome is Outcome.CUT_OFF
            assert recording.events[-1].kind == EventKind.HOST_LOST


def test_the_page_is_killed_eight_times(tmp_path):
    rng = np.random.default_rng(4)
    with bench(tmp_path, parts=("host", "record")) as made:
        link = made.link()
        first = begin(link)
        path = caught_up(made, link, first)
        for _ in range(8):
            made.start("page")
            sleep(rng, 0.1, 2.5)
            made.kill("page")
            assert state_of(link) is State.RUNNING
            assert lives(made.pid("host")) and lives(made.pid("record"))
        end(made, link)
        recording = Recording.load(path)
        assert_holds(recording, link, first)
        assert recording.verdict.outcome is Outcome.STOPPED


def test_the_supervisor_is_killed_four_times(tmp_path):
    """Host, recorder and page go on; whoever steers stops the run, and its file is whole."""
    rng = np.random.default_rng(5)
    for i in range(4):
        folder = tmp_path / str(i)
        folder.mkdir()
        with supervised(folder) as made:
            link = made.link()
            wait_for(lambda: read_report(made.session.folder))
            first = begin(link)
            path = caught_up(made, link, first)
            sleep(rng, 0.0, 1.0)
            made.kill("supervisor")
            head = link.ring.head
            gather(link, head, SECOND // 2)
            assert state_of(link) is State.RUNNING
            end(made, link)
            recording = Recording.load(path)
            assert_holds(recording, link, first)
            assert len(recording) > head - first
            assert recording.verdict.outcome is Outcome.STOPPED
