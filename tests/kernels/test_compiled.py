"""Compiling: kept by content, safe from several processes, and never in the way."""

from __future__ import annotations

import os
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest

import alight
from alight.kernels import runner
from alight.kernels.compiled import (
    Compiled,
    CompilerUnavailable,
    cache_folder,
    find_compiler,
    library_of,
    source_of,
)
from tests.kernels.programs import NOISY, Prepared, counting, has_compiler, noise_of, prepared

NEEDS_COMPILER = pytest.mark.skipif(not has_compiler(), reason="no C compiler on this machine")
ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def program() -> Prepared:
    return prepared(counting())


@pytest.fixture
def fresh(monkeypatch, tmp_path):
    """An empty cache folder, and a compiler that is searched anew."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    find_compiler.cache_clear()
    yield tmp_path
    find_compiler.cache_clear()


def script(path: Path, text: str) -> Path:
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(0o755)
    return path


def kept() -> list[Path]:
    return sorted(cache_folder().iterdir()) if cache_folder().exists() else []


# The cache


@NEEDS_COMPILER
def test_a_program_is_compiled_once(fresh, program):
    first = Compiled(program.program)
    (library,) = kept()
    built = library.stat().st_mtime_ns
    second = Compiled(program.program)
    assert kept() == [library] and library.stat().st_mtime_ns == built
    noise = noise_of(100)
    np.testing.assert_array_equal(program.run(first, noise)[1], program.run(second, noise)[1])


@NEEDS_COMPILER
def test_other_numbers_are_the_same_program_and_other_structures_are_not(fresh, program):
    same = prepared(counting(trip_at=5.0))
    other = prepared(counting(), channels=("q",))
    assert source_of(same.program) == source_of(program.program)
    paths = {library_of(source_of(each.program)) for each in (program, same, other)}
    assert len(paths) == 2 and sorted(paths) == kept()


@NEEDS_COMPILER
def test_a_library_belongs_to_its_source_and_its_compiler(fresh, program, monkeypatch):
    plain = library_of(source_of(program.program))
    assert library_of(source_of(program.program) + "\n") != plain
    monkeypatch.setenv("CC", str(script(fresh / "wrapped", f'exec {find_compiler()} "$@"')))
    find_compiler.cache_clear()
    assert library_of(source_of(program.program)) != plain
    assert len(kept()) == 3


@NEEDS_COMPILER
def test_nothing_but_the_library_is_left(fresh, program):
    Compiled(program.program)
    assert [path.suffix for path in kept()] == [".so"]


def test_the_cache_lies_in_the_users_cache_folder(monkeypatch, tmp_path):
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert cache_folder() == tmp_path / "alight"
    monkeypatch.setenv("XDG_CACHE_HOME", "")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert cache_folder() == tmp_path / ".cache" / "alight"


BUILD = """
import sys, time
from pathlib import Path
import numpy as np
from alight.kernels.compiled import Compiled
from tests.kernels.programs import counting, noise_of, prepared

program = prepared(counting())
Path(sys.argv[1], f"ready-{sys.argv[2]}").touch()
while len(list(Path(sys.argv[1]).glob("ready-*"))) < 2:
    time.sleep(0.001)
_, y = program.run(Compiled(program.program), noise_of(100))
np.save(Path(sys.argv[1], f"rows-{sys.argv[2]}.npy"), y)
"""


@NEEDS_COMPILER
def test_two_processes_may_build_the_same_program_at_the_same_time(fresh, program):
    source = str(Path(alight.__file__).parents[1])
    paths = [source, str(ROOT), os.environ.get("PYTHONPATH", "")]
    env = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, paths))}
    processes = [
        subprocess.Popen(
            [sys.executable, "-c", BUILD, str(fresh), str(i)], env=env, stderr=subprocess.PIPE
        )
        for i in range(2)
    ]
    for process in processes:
        _, errors = process.communicate(timeout=120)
        assert process.returncode == 0, errors.decode()
    rows = [np.load(fresh / f"rows-{i}.npy") for i in range(2)]
    _, expected = program.run(runner(program.program, "vm"), noise_of(100))
    np.testing.assert_array_equal(rows[0], expected)
    np.testing.assert_array_equal(rows[1], expected)
    assert len(kept()) == 1


# Without a working compiler


def broken(fresh: Path, monkeypatch: pytest.MonkeyPatch, how: str) -> str:
    """Break the compiler, and return what the error says of it."""
    if how == "missing":
        monkeypatch.setenv("PATH", str(fresh))
        monkeypatch.delenv("CC", raising=False)
        return "no C compiler .* on the path"
    if how == "failing":
        path = script(fresh / "cc-fails", "echo 'no space for poetry' >&2; exit 1")
        said = "no space for poetry"
    elif how == "not a program":
        path = fresh / "cc-text"
        path.write_bytes(b"\x00\x01\x02")
        path.chmod(0o755)
        said = "does not run"
    else:
        path = script(fresh / "cc-idle", "exit 0")
        said = "cannot build|failed"
    monkeypatch.setenv("CC", str(path))
    return said


BROKEN = pytest.mark.parametrize("how", ["missing", "failing", "not a program", "idle"])


@BROKEN
def test_auto_falls_back_to_the_virtual_machine_with_one_warning(fresh, program, monkeypatch, how):
    said = broken(fresh, monkeypatch, how)
    with pytest.warns(UserWarning, match=f"virtual machine, several times slower: .*({said})") as w:
        made = runner(program.program, "auto")
    assert len(w) == 1
    assert made.name == "vm"
    assert len(program.run(made, noise_of(20))[1]) == 20
    assert not [path for path in kept() if path.suffix == ".so"]


@BROKEN
def test_who_insists_on_c_is_refused(fresh, program, monkeypatch, how):
    said = broken(fresh, monkeypatch, how)
    with pytest.raises(CompilerUnavailable, match=said):
        runner(program.program, "c")


@BROKEN
def test_the_virtual_machine_asks_for_no_compiler(fresh, program, monkeypatch, how):
    broken(fresh, monkeypatch, how)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert runner(program.program, "vm").name == "vm"
    assert kept() == []


def test_a_cache_folder_that_cannot_be_made_is_no_reason_to_fail(fresh, program, monkeypatch):
    (fresh / "file").write_text("in the way")
    monkeypatch.setenv("XDG_CACHE_HOME", str(fresh / "file"))
    monkeypatch.setenv("CC", str(script(fresh / "cc-any", "echo 'compiler 1.0'")))
    with pytest.warns(UserWarning, match="cannot build in"):
        assert runner(program.program).name == "vm"


def test_the_noise_of_these_programs_reaches_the_law():
    """The loops above are worth comparing: their transducer is noisy and quantised."""
    assert NOISY.transducer.noise > 0 and NOISY.transducer.resolution > 0
    program = prepared(counting(), channels=("x_m_measured",))
    vm = runner(program.program, "vm")
    one, other = (program.run(vm, noise_of(50, seed))[1] for seed in (1, 2))
    assert (one != other).any()
