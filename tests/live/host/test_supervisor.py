"""The supervisor replaces what may be replaced, and ends in order without leaving a trace."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
import urllib.request
from pathlib import Path

import pytest

from alight.live.session import MEMORY, Link
from alight.live.shared.commands import Kind, Outcome
from alight.live.shared.status import State
from alight.live.supervisor import sweep
from tests.cli.command import OWN_ARM, argv, environment
from tests.live.bench import (
    PATIENCE,
    ask,
    columns,
    gather,
    lives,
    state_of,
    supervised,
    wait_for,
)

LINUX = pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
SLOW_RATE = "testbed.sample_rate=500.0"


def children(process: int) -> dict[str, tuple[int, str]]:
    """Processes of a bench by the name of their part: their number, and the session's folder."""
    found = {}
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            words = path.read_text().split("\0")
            parent = path.with_name("stat").read_text().rpartition(")")[2].split()[1]
        except OSError:
            continue
        for word in words:
            if word.startswith("alight.live.") and int(parent) == process:
                found[word.rpartition(".")[2]] = (
                    int(path.parent.name),
                    words[words.index(word) + 1],
                )
    return found


@LINUX
@pytest.mark.slow
@pytest.mark.parametrize("stop", [signal.SIGINT, signal.SIGTERM])
def test_ctrl_c_in_mid_run_ends_all_in_order(tmp_path, stop):
    """Code 0, a whole recording, no process, no folder; the page was there in between."""
    options = ("--port", "0", "--out", str(tmp_path / "recordings"), "--set", SLOW_RATE)
    command = argv("live", OWN_ARM, *options)
    bench = subprocess.Popen(
        command, env=environment(), stderr=subprocess.PIPE, text=True, process_group=0
    )
    assert bench.stderr
    parts: dict[str, tuple[int, str]] = {}
    try:
        said = ""
        while "Ctrl-C ends the bench" not in said:
            line = bench.stderr.readline()
            assert line, said
            said += line
        (url,) = re.findall(r"http://127\.0\.0\.1:\d+/", said)
        assert urllib.request.urlopen(url, timeout=PATIENCE).status == 200
        assert str(tmp_path / "recordings") in said
        assert "priority: " in said and "memory: " in said
        parts = children(bench.pid)
        assert set(parts) == {"host", "record", "page"}
        folder = Path(parts["host"][1])
        link = Link.open(folder / "host-1")
        ask(link, Kind.START)
        gather(link, link.ring.head, 300)
        bench.send_signal(stop)
        assert bench.wait(PATIENCE) == 0
        assert "Traceback" not in bench.stderr.read()
        assert not folder.exists()
        assert state_of(link) is State.STOPPED
        assert not any(lives(number) for number, _ in parts.values())
        (recording,) = (tmp_path / "recordings").glob("*.mcap")
        assert recording.read_bytes().endswith(b"\x89MCAP0\r\n")
    finally:
        bench.kill()
        bench.wait()
        bench.stderr.close()
        for number, _ in parts.values():
            if lives(number):
                os.kill(number, signal.SIGKILL)


@pytest.mark.slow
def test_each_process_that_dies_leaves_the_others_as_they_were(tmp_path):
    """Recorder and page are replaced; the host is not, until it is asked for."""
    with supervised(tmp_path, OWN_ARM, [SLOW_RATE]) as bench:
        link = bench.link()
        begun = ask(link, Kind.START)
        for part in ("record", "page"):
            before = bench.pid(part)
            bench.kill(part)
            wait_for(lambda: bench.pid(part) != before)  # noqa: B023
        rows = gather(link, begun.tick, link.ring.head - begun.tick)
        assert (rows[:, columns(link, "state")] == State.RUNNING).all()
        survivors = {part: bench.pid(part) for part in ("record", "page")}
        host = bench.pid("host")
        bench.kill("host")
        time.sleep(0.5)
        assert bench.pid("host") == host and bench.session.hosts == [link.folder]
        assert {part: bench.pid(part) for part in survivors} == survivors
        assert all(lives(number) for number in survivors.values())
        (bench.session.folder / "restart-host").touch()
        second = Link.wait(bench.session, newer_than=link.folder)
        assert ask(second, Kind.START).outcome is Outcome.APPLIED
        assert not (bench.session.folder / "restart-host").exists()


@pytest.mark.slow
def test_the_supervisor_killed_the_others_go_on(tmp_path):
    with supervised(tmp_path, OWN_ARM, [SLOW_RATE]) as bench:
        link = bench.link()
        ask(link, Kind.START)
        bench.kill("supervisor")
        gather(link, link.ring.head, 200)
        assert state_of(link) is State.RUNNING
        assert all(lives(bench.pid(part)) for part in ("host", "record", "page"))


@pytest.mark.slow
def test_without_supervisor_page_and_run_host_and_recorder_end(tmp_path):
    with supervised(tmp_path, OWN_ARM, [SLOW_RATE]) as bench:
        link = bench.link()
        ask(link, Kind.START)
        bench.kill("supervisor")
        bench.kill("page")
        time.sleep(5.0)
        assert state_of(link) is State.RUNNING and lives(bench.pid("host"))
        ask(link, Kind.STOP)
        wait_for(lambda: not lives(bench.pid("host")))
        wait_for(lambda: not lives(bench.pid("record")))
        assert bench.session.folder.exists()

        def swept() -> bool:
            sweep(bench.session.folder.parent)
            return not bench.session.folder.exists()

        wait_for(swept)


def test_a_sweep_takes_what_no_process_uses_and_nothing_else(tmp_path):
    left, mine, other = (tmp_path / f"alight-{name}" for name in ("left", "mine", "other"))
    for folder in (left, mine, other):
        folder.mkdir()
        (folder / "ring").touch()
    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait()
    for folder in (left, mine):
        (folder / "supervisor.pid").write_text(str(gone.pid))
    (mine / "host.pid").write_text(str(os.getpid()))
    sweep(tmp_path)
    assert (left.exists(), mine.exists(), other.exists()) == (False, True, True)


@LINUX
@pytest.mark.slow
def test_a_host_that_never_begins_ends_the_bench_with_its_reason(tmp_path):
    before = set(MEMORY.glob("alight-*"))
    drives = tmp_path / "drives.toml"
    example = (Path(__file__).parents[3] / "examples" / "drives.toml").read_text()
    drives.write_text(example.replace("socketcan", "no-such-interface"))
    options = ("--port", "0", "--out", str(tmp_path / "out"), "--drives", str(drives))
    command = argv("live", "experiment-1", *options)
    done = subprocess.run(
        command,
        env=environment(),
        capture_output=True,
        text=True,
        timeout=2 * PATIENCE,
        check=False,
    )
    assert done.returncode == 2
    assert "no-such-interface can0 cannot be opened" in done.stderr
    assert "error: the host was never ready" in done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "out").exists()
    sessions = (path / "session.json" for path in set(MEMORY.glob("alight-*")) - before)
    assert not [path for path in sessions if str(tmp_path) in path.read_text()]
