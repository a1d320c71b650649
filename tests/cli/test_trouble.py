"""Folders that cannot be written, a full disk, Ctrl-C: a message, an exit code, no half file."""

from __future__ import annotations

import contextlib
import os
import pty
import re
import resource
import select
import signal
import subprocess
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

import alight
from tests.cli.command import OWN_ARM, SHORT, argv, environment, invoke, process

LONG = ("run", OWN_ARM, "--set", "duration=600", "--backend", "vm")
"""A minute's work at least."""


# Folders


def test_a_file_in_the_place_of_the_folder(tmp_path):
    out = tmp_path / "out"
    out.write_text("mine")
    result = invoke("run", OWN_ARM, *SHORT, "--out", str(out))
    assert (result.exit_code, result.stdout) == (2, "")
    assert result.stderr == f"error: {out}: is a file; --out needs a folder\n"
    assert out.read_text() == "mine"


def test_a_file_above_the_folder(tmp_path):
    (tmp_path / "file").write_text("mine")
    out = tmp_path / "file" / "out"
    result = invoke("run", OWN_ARM, *SHORT, "--out", str(out))
    assert (result.exit_code, result.stdout) == (2, "")
    assert f"{out}: no files can be written into this folder: Not a directory" in result.stderr


def test_a_folder_that_refuses_files():
    """Found out before the run, which would have been for nothing."""
    with tempfile.TemporaryDirectory() as folder:
        os.chmod(folder, 0o555)
        started = time.monotonic()
        for out in (Path(folder), Path(folder, "new")):
            with ordinary_user():
                result = invoke(*LONG, "--out", str(out))
            assert (result.exit_code, result.stdout) == (2, "")
            assert f"{out}: no files can be written into this folder" in result.stderr
            assert "Permission denied" in result.stderr
        assert time.monotonic() - started < 30
        assert os.listdir(folder) == []


@pytest.mark.skipif(not os.path.isdir("/proc/self"), reason="no such file system here")
def test_a_file_system_that_holds_no_files():
    result = invoke("run", OWN_ARM, *SHORT, "--out", "/proc/self/out")
    assert result.exit_code == 2
    assert "/proc/self/out: no files can be written" in result.stderr


@contextlib.contextmanager
def ordinary_user() -> Iterator[None]:
    """Give up the rights of root, whom no permission stops."""
    root = os.geteuid() == 0
    if root:
        os.seteuid(65534)
    try:
        yield
    finally:
        if root:
            os.seteuid(0)


# A full disk


def at_most(size: int) -> None:
    """Let no file of this process grow beyond a size [bytes], as a full disk would."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))


@pytest.mark.parametrize("existing", [True, False])
def test_a_disk_that_is_full_at_once_leaves_nothing_behind(tmp_path, existing):
    out = tmp_path / "out"
    if existing:
        out.mkdir()
        (out / "recording.parquet").write_text("an older one")
    args = ("run", OWN_ARM, *SHORT, "--backend", "vm", "--out", str(out))
    done = process(*args, preexec_fn=lambda: at_most(20_000))
    assert done.returncode == 2
    assert done.stderr == f"error: {out}/recording.parquet: cannot be written: File too large\n"
    assert "first contact" in done.stdout  # what was computed is still told
    if existing:
        assert os.listdir(out) == ["recording.parquet"]
        assert (out / "recording.parquet").read_text() == "an older one"
    else:
        assert os.listdir(tmp_path) == []


def test_a_disk_that_fills_up_leaves_whole_files_only(tmp_path):
    run = alight.simulate(alight.load_scenario(OWN_ARM, [s for s in SHORT if s != "--set"]))
    size = []
    for suffix in ("parquet", "mcap"):
        run.save(tmp_path / f"one.{suffix}")
        size.append((tmp_path / f"one.{suffix}").stat().st_size)
    limit = sum(size) // 2
    assert size[0] < limit < size[1]
    full = tmp_path / "full"
    args = ("run", OWN_ARM, *SHORT, "--backend", "vm", "--out", str(full))
    done = process(*args, preexec_fn=lambda: at_most(limit))
    assert done.returncode == 2
    assert f"{full}/recording.mcap: cannot be written: File too large" in done.stderr
    assert sorted(os.listdir(full)) == ["recording.parquet", "summary.json"]
    loaded = alight.Recording.load(full / "recording.parquet")
    assert loaded.samples.tobytes() == run.samples.tobytes()


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no such device here")
@pytest.mark.parametrize("args", [("run", OWN_ARM, *SHORT, "--json"), ("scenarios",)])
def test_a_full_disk_behind_the_standard_output(args):
    with open("/dev/full", "w") as full:
        done = process(*args, stdout=full)
    assert done.returncode == 2
    assert done.stderr == ("error: standard output: cannot be written: No space left on device\n")


def test_a_reader_that_goes_away_is_no_error_to_speak_of():
    with subprocess.Popen(
        argv("scenarios", "experiment-1"),
        env=environment(),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    ) as child:
        assert child.stdout is not None
        child.stdout.close()
        _, complaint = child.communicate(timeout=120)
    assert complaint == b""


# Ctrl-C, at a terminal


class Terminal:
    """What a process writes to its terminal on stderr."""

    def __init__(self, *args: str) -> None:
        self._own, other = pty.openpty()
        env = environment(TERM="xterm", COLUMNS="100", NO_COLOR=None, FORCE_COLOR=None)
        self.child = subprocess.Popen(argv(*args), env=env, stdout=subprocess.PIPE, stderr=other)
        os.close(other)
        self.text = ""

    def read_until(self, pattern: str, timeout: float = 120.0) -> re.Match[str] | None:
        """Read until a pattern shows; None if the process closes its terminal before."""
        deadline = time.monotonic() + timeout
        while not (found := re.search(pattern, self.text)):
            assert time.monotonic() < deadline, f"{pattern!r} not in {self.text!r}"
            if not select.select([self._own], [], [], 1.0)[0]:
                continue
            try:
                self.text += os.read(self._own, 4096).decode(errors="replace")
            except OSError:  # the other end is closed
                return None
        return found

    def __enter__(self) -> Terminal:
        return self

    def __exit__(self, *_: object) -> None:
        self.child.kill()
        self.child.communicate()
        os.close(self._own)


def test_ctrl_c_in_a_long_run_says_so_and_leaves_no_file(tmp_path):
    """Progress with percentage and time remaining shows first."""
    out = tmp_path / "out"
    with Terminal(*LONG, "--out", str(out)) as terminal:
        assert terminal.read_until(r"running own_arm")
        assert terminal.read_until(r"\d+%\S* *\S*\d:\d\d:\d\d")
        assert out.is_dir()
        terminal.child.send_signal(signal.SIGINT)
        assert terminal.read_until(r"interrupted\r?\n")
        stdout, _ = terminal.child.communicate(timeout=60)
        assert terminal.child.returncode == 130
    assert stdout == b"" and "Traceback" not in terminal.text
    assert os.listdir(tmp_path) == []


def test_ctrl_c_keeps_the_files_of_an_earlier_run(tmp_path):
    assert invoke("run", OWN_ARM, *SHORT, "--out", str(tmp_path)).exit_code == 0
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    with Terminal(*LONG, "--out", str(tmp_path)) as terminal:
        assert terminal.read_until(r"running own_arm")
        terminal.child.send_signal(signal.SIGINT)
        assert terminal.read_until(r"interrupted\r?\n")  # a bar that nobody reads blocks the child
        terminal.child.communicate(timeout=60)
        assert terminal.child.returncode == 130
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before
