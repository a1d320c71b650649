"""Libraries under trouble: builds that are killed, shared, damaged; folders that refuse."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

import alight
from alight.kernels import toolchain
from alight.kernels.compilers import find_compiler
from alight.kernels.toolchain import is_kept, library_of, load
from tests.compiler import NEEDS_COMPILER, has_compiler
from tests.kernels.compilers import (
    FLAGS,
    SOURCE,
    kept,
    other,
    runs,
    seven,
    until,
    waiting_compiler,
)

pytestmark = pytest.mark.usefixtures("cache")


def process(code: str, *args: object, **env: str) -> subprocess.Popen[bytes]:
    """A Python process of its own, with the same cache folder."""
    source = str(Path(alight.__file__).parents[1])
    paths = [source, str(Path(__file__).parents[2]), os.environ.get("PYTHONPATH", "")]
    own = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, paths)), **env}
    command = [sys.executable, "-c", code, *map(str, args)]
    return subprocess.Popen(command, env=own, stdout=subprocess.PIPE, stderr=subprocess.PIPE)


BUILD = f"""
from alight.kernels.toolchain import load
load({SOURCE!r}, flags={FLAGS!r})
"""


# Killed and interrupted


@pytest.mark.parametrize("by", [signal.SIGKILL, signal.SIGINT])
def test_a_build_that_is_ended_midway_leaves_no_library(monkeypatch, tmp_path, by):
    """The next one builds; what a killed one left goes when it is old, Ctrl-C leaves nothing."""
    builder = process(BUILD, CC=waiting_compiler(tmp_path))
    until(lambda: (tmp_path / "child").exists())
    child = int((tmp_path / "child").read_text())
    try:
        builder.send_signal(by)
        builder.communicate(timeout=60)
        assert builder.returncode != 0
        if by == signal.SIGINT:
            until(lambda: not runs(child))
            assert kept() == []
            return
    finally:
        if runs(child):
            os.kill(child, signal.SIGKILL)
    (left,) = kept()
    assert left.is_dir() and not list(left.glob("*.so"))
    if has_compiler():
        library_of(SOURCE, flags=FLAGS)
        assert left.exists(), "it may be a build of now"
        old = time.time() - 2 * toolchain.ABANDONED
        os.utime(left, (old, old))
        library_of(other(8), flags=FLAGS)
        assert not left.exists()
        assert len(kept()) == 2


@NEEDS_COMPILER
def test_libraries_that_nobody_uses_go_and_those_in_use_stay():
    used, unused = library_of(SOURCE, flags=FLAGS), library_of(other(8), flags=FLAGS)
    old = time.time() - 2 * toolchain.UNUSED
    for path in (used, unused):
        os.utime(path, (old, old))
    assert library_of(SOURCE, flags=FLAGS) == used
    library_of(other(9), flags=FLAGS)
    assert used.exists() and not unused.exists()


# Shared


@NEEDS_COMPILER
def test_processes_may_build_the_same_at_the_same_time(tmp_path):
    code = f"""
import sys, time
from pathlib import Path
from alight.kernels.toolchain import load
here = Path(sys.argv[1])
(here / f"ready-{{sys.argv[2]}}").touch()
while len(list(here.glob("ready-*"))) < 4:
    time.sleep(0.001)
assert load({SOURCE!r}, flags={FLAGS!r}).seven
"""
    processes = [process(code, tmp_path, i) for i in range(4)]
    for each in processes:
        _, errors = each.communicate(timeout=120)
        assert each.returncode == 0, errors.decode()
    assert len(kept()) == 1


@NEEDS_COMPILER
def test_threads_may_build_the_same_at_the_same_time():
    made: list[float] = []
    threads = [
        threading.Thread(target=lambda: made.append(seven(load(SOURCE, flags=FLAGS))))
        for _ in range(4)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert made == [7.0] * 4 and len(kept()) == 1


# Damaged


@NEEDS_COMPILER
@pytest.mark.parametrize("share", [0.0, 0.01, 0.5, 0.99])
def test_a_library_that_was_cut_short_is_built_anew(share):
    """In a process of its own: to load such a file would end it with a bus error."""
    path = library_of(SOURCE, flags=FLAGS)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])
    assert not is_kept(SOURCE, flags=FLAGS)
    builder = process(BUILD)
    _, errors = builder.communicate(timeout=120)
    assert builder.returncode == 0, errors.decode()
    (anew,) = kept()
    assert anew.read_bytes() == whole


@NEEDS_COMPILER
def test_a_cache_folder_full_of_junk_is_as_good_as_an_empty_one(cache):
    cache.mkdir(parents=True)
    name = library_of(SOURCE, flags=FLAGS).name
    shutil.rmtree(cache)
    cache.mkdir()
    (cache / name).write_bytes(b"no library at all")
    (cache / f"{name.partition('-')[0]}-.so").write_bytes(b"")
    (cache / f"{name.partition('-')[0]}-folder.so").mkdir()
    (cache / "build-of-nothing").write_text("a file")
    (cache / "link.so").symlink_to(cache / "nowhere")
    assert seven(load(SOURCE, flags=FLAGS)) == 7.0


@NEEDS_COMPILER
def test_a_library_removed_between_finding_and_loading_is_built_anew(monkeypatch):
    find, removed = toolchain.library_of, []

    def find_and_lose(source: str, *, flags: tuple[str, ...]) -> Path:
        path = find(source, flags=flags)
        if not removed:
            path.unlink()
            removed.append(path)
        return path

    monkeypatch.setattr(toolchain, "library_of", find_and_lose)
    assert seven(load(other(11), flags=FLAGS)) == 11.0
    assert removed


@NEEDS_COMPILER
@pytest.mark.skipif(os.geteuid() != 0, reason="giving files away needs root")
def test_the_library_of_somebody_else_is_not_loaded():
    path = library_of(SOURCE, flags=FLAGS)
    os.chown(path, 12345, 12345)
    assert not is_kept(SOURCE, flags=FLAGS)
    assert library_of(SOURCE, flags=FLAGS).stat().st_uid == os.geteuid()


# File systems


READ_ONLY = f"""
import os, warnings
os.environ["XDG_CACHE_HOME"] = os.environ["MOUNTED"]
from alight.kernels.toolchain import library_of, load
with warnings.catch_warnings(record=True) as told:
    warnings.simplefilter("always")
    print(library_of({SOURCE!r}, flags={FLAGS!r}).parent)
    load({SOURCE!r}, flags={FLAGS!r})
print(*(each.message for each in told), sep="|")
"""


def mounted(tmp_path: Path, options: str, code: str, **env: str) -> tuple[int, str, str]:
    """Run Python code with a file system of its own at ``$MOUNTED``."""
    place = tmp_path / "mounted"
    place.mkdir(exist_ok=True)
    command = ["unshare", "--map-root-user", "--mount", "sh", "-c"]
    mount = f"mount -t tmpfs -o {options} none {place}"
    try:
        able = subprocess.run([*command, mount], capture_output=True, check=False).returncode == 0
    except FileNotFoundError:
        able = False
    if not able:
        pytest.skip("this process may not mount anything")
    source = str(Path(alight.__file__).parents[1])
    done = subprocess.run(
        [*command, f'{mount} && exec "$0" -c "$1"', sys.executable, code],
        env={**os.environ, "PYTHONPATH": source, "MOUNTED": str(place), **env},
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )
    return done.returncode, done.stdout, done.stderr


@NEEDS_COMPILER
def test_a_read_only_home_compiles_for_each_process_and_says_so(tmp_path):
    code, out, err = mounted(tmp_path, "ro", READ_ONLY)
    assert code == 0, err
    folder, told = out.splitlines()
    assert re.search(r"alight-\w+$", folder) and not Path(folder).exists()
    assert told.count("|") == 0 and "compiles anew: [Errno 30] Read-only file system" in told


@NEEDS_COMPILER
def test_a_folder_that_allows_no_programs_is_named(tmp_path):
    chosen = shlex.join(find_compiler().command)
    code, out, err = mounted(tmp_path, "noexec", READ_ONLY, CC=chosen)
    assert code != 0 and out == ""
    assert "CompilerUnavailable: what was compiled cannot be loaded" in err
    assert "is the folder one that allows programs?" in err
