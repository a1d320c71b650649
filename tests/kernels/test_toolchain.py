"""Libraries are built once and kept by content, by whatever compiler works."""

from __future__ import annotations

import ctypes
import os
import shlex
import sys
import time
import warnings
from pathlib import Path

import pytest

from alight.kernels import toolchain
from alight.kernels.compilers import Compiler, CompilerUnavailable, compilers, find_compiler
from alight.kernels.toolchain import cache_folder, is_kept, library_of, load
from tests.compiler import NEEDS_COMPILER
from tests.kernels.compilers import (
    ANSWERS,
    FLAGS,
    SOURCE,
    broken_compilers,
    kept,
    other,
    runs,
    script,
    seven,
    until,
    waiting_compiler,
)

pytestmark = pytest.mark.usefixtures("cache")


# Built once


@NEEDS_COMPILER
def test_a_library_is_built_once_and_nothing_else_is_left():
    assert not is_kept(SOURCE, flags=FLAGS)
    path = library_of(SOURCE, flags=FLAGS)
    built = path.stat().st_mtime_ns
    assert is_kept(SOURCE, flags=FLAGS)
    assert library_of(SOURCE, flags=FLAGS) == path and path.stat().st_mtime_ns == built
    assert kept() == [path]
    assert seven(load(SOURCE, flags=FLAGS)) == 7.0


@NEEDS_COMPILER
def test_a_library_belongs_to_its_source_its_flags_and_its_compiler(monkeypatch, tmp_path):
    paths = {library_of(SOURCE, flags=FLAGS)}
    paths.add(library_of(SOURCE + "\n", flags=FLAGS))
    paths.add(library_of(SOURCE, flags=("-O2",)))
    wrapped = shlex.join(find_compiler().command)
    monkeypatch.setenv("CC", script(tmp_path / "wrapped", f'exec {wrapped} "$@"'))
    paths.add(library_of(SOURCE, flags=FLAGS))
    assert len(paths) == 4 and kept() == sorted(paths)


@NEEDS_COMPILER
def test_an_upgraded_compiler_builds_anew(monkeypatch, tmp_path):
    wrapped = shlex.join(find_compiler().command)
    path = Path(script(tmp_path / "cc-1", f'exec {wrapped} "$@"'))
    monkeypatch.setenv("CC", str(path))
    first = library_of(SOURCE, flags=FLAGS)
    os.utime(path, (1e9, 1e9))
    assert library_of(SOURCE, flags=FLAGS) != first


@NEEDS_COMPILER
def test_the_present_processor_is_what_march_native_means():
    """The flag is understood by every compiler of this machine, and not forgotten on the way."""
    widest = """
    #if defined(__AVX512F__)
    double seven(void) { return 512; }
    #elif defined(__AVX2__)
    double seven(void) { return 256; }
    #else
    double seven(void) { return 128; }
    #endif
    """
    width = seven(load(widest, flags=("-march=native",)))
    cpu = Path("/proc/cpuinfo")
    words = cpu.read_text().split() if cpu.exists() else []
    assert width == (512 if "avx512f" in words else 256 if "avx2" in words else 128)
    assert seven(load(widest, flags=())) == 128


def test_each_compiler_is_told_of_the_processor_in_its_own_words(monkeypatch):
    gcc, clang = Compiler(("/usr/bin/gcc",), "gcc 12"), Compiler(("/usr/bin/cc",), "Apple clang 16")
    zig = Compiler((sys.executable, "-m", "ziglang", "cc"), "0.13.0")
    native, asked = ("-O2", "-march=native"), ("-O2", "-mcpu=native")
    for machine, expected in (("x86_64", native), ("arm64", asked), ("aarch64", asked)):
        monkeypatch.setattr("platform.machine", lambda name=machine: name)
        assert gcc.spelled(native) == native
        assert clang.spelled(native) == expected
        assert zig.spelled(native) == asked
        assert zig.spelled(("-O2",)) == ("-O2", "-mcpu=baseline")
        assert clang.spelled(("-O2",)) == ("-O2",)


# Which compiler


def test_the_chosen_compiler_may_have_arguments_and_is_the_only_one(monkeypatch, tmp_path):
    path = script(tmp_path / "cc-any", ANSWERS)
    monkeypatch.setenv("CC", f"{path} -m64 '-I/a b'")
    (only,) = compilers()
    assert only.command == (path, "-m64", "-I/a b")


def test_a_path_with_a_space_is_one_word(monkeypatch, tmp_path):
    (tmp_path / "my tools").mkdir()
    path = script(tmp_path / "my tools" / "cc", ANSWERS)
    monkeypatch.setenv("CC", path)
    assert find_compiler().command == (path,)


def test_ziglang_is_used_where_the_path_has_no_compiler(monkeypatch, tmp_path):
    """The one from PyPI, really: it compiles, and what it makes is loaded."""
    pytest.importorskip("ziglang")
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert find_compiler().name == "ziglang"
    library = load(SOURCE, flags=("-O2", "-march=native", "-ffp-contract=off"))
    assert seven(library) == 7.0
    library.f.restype, library.f.argtypes = ctypes.c_double, [ctypes.c_double]
    assert library.f(0.5) == pytest.approx(0.46211715726000973, rel=1e-15)


@NEEDS_COMPILER
def test_a_compiler_on_the_path_that_does_not_work_leaves_the_next_one(monkeypatch, tmp_path):
    real = find_compiler()
    monkeypatch.delenv("CC", raising=False)
    script(tmp_path / "cc", ANSWERS, "echo 'math.h: no such file' >&2; exit 1")
    script(tmp_path / "gcc", f'PATH={os.environ["PATH"]} exec {shlex.join(real.command)} "$@"')
    monkeypatch.setenv("PATH", str(tmp_path))
    assert [Path(each.command[0]).name for each in compilers()[:2]] == ["cc", "gcc"]
    assert seven(load(SOURCE, flags=FLAGS)) == 7.0
    # what failed is not tried again while there is a library
    os.remove(tmp_path / "cc")
    script(tmp_path / "cc", ANSWERS, f"touch {tmp_path}/asked; exit 1")
    assert seven(load(SOURCE, flags=FLAGS)) == 7.0
    assert not (tmp_path / "asked").exists()


def test_where_there_is_no_compiler_at_all_the_message_says_what_would_help(monkeypatch, tmp_path):
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setitem(sys.modules, "ziglang", None)
    with pytest.raises(
        CompilerUnavailable, match=r"no C compiler \(cc, gcc, clang\).*alight\[zig\]"
    ):
        library_of(SOURCE, flags=FLAGS)
    assert not is_kept(SOURCE, flags=FLAGS)


BROKEN = ("missing", "unreadable", "not a program", "mute", "failing", "idle", "babbling")


@pytest.mark.parametrize("how", BROKEN)
def test_a_broken_compiler_is_refused_by_name_and_leaves_nothing(monkeypatch, tmp_path, how):
    chosen, said = broken_compilers(tmp_path)[how]
    monkeypatch.setenv("CC", chosen)
    for _ in range(2):
        with pytest.raises(CompilerUnavailable, match=said):
            load(SOURCE, flags=FLAGS)
        assert kept() == []
    assert not is_kept(SOURCE, flags=FLAGS)


def test_the_list_of_broken_compilers_is_whole(tmp_path):
    assert tuple(broken_compilers(tmp_path)) == BROKEN


@NEEDS_COMPILER
def test_source_that_is_no_c_is_refused_with_the_compilers_own_words(monkeypatch):
    monkeypatch.setenv("CC", shlex.join(find_compiler().command))
    with pytest.raises(CompilerUnavailable, match=r"failed: .*error"):
        library_of("double f(void) { return poetry; }", flags=FLAGS)
    assert kept() == []


def test_a_compiler_that_hangs_is_ended_with_its_children(monkeypatch, tmp_path):
    monkeypatch.setenv("CC", waiting_compiler(tmp_path))
    monkeypatch.setattr(toolchain, "BUILD_LIMIT", 0.5)
    began = time.monotonic()
    with pytest.raises(CompilerUnavailable, match=r"was not done after 0\.5 s"):
        library_of(SOURCE, flags=FLAGS)
    assert time.monotonic() - began < 30.0
    child = int((tmp_path / "child").read_text())
    until(lambda: not runs(child))
    assert kept() == []


def test_a_compiler_that_hangs_when_asked_its_version_is_refused(monkeypatch, tmp_path):
    monkeypatch.setattr("alight.kernels.compilers.ANSWER_LIMIT", 0.5)
    monkeypatch.setenv("CC", script(tmp_path / "cc-sleeps", "exec sleep 1000"))
    with pytest.raises(CompilerUnavailable, match="cc-sleeps does not run"):
        library_of(SOURCE, flags=FLAGS)


# Folders


def test_the_cache_lies_in_the_users_cache_folder(monkeypatch, tmp_path):
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setenv("HOME", str(tmp_path))
    for given in ("", "relative/folder"):
        monkeypatch.setenv("XDG_CACHE_HOME", given)
        assert cache_folder() == tmp_path / ".cache" / "alight"
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "own"))
    assert cache_folder() == tmp_path / "own" / "alight"
    monkeypatch.setattr(sys, "platform", "darwin")
    assert cache_folder() == tmp_path / "Library" / "Caches" / "alight"


@NEEDS_COMPILER
def test_where_nothing_can_be_kept_it_is_built_for_this_process_with_one_warning(
    monkeypatch, tmp_path
):
    """A file stands where the folder should be, which stops even root."""
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    with pytest.warns(
        UserWarning, match="not kept, .* each process compiles anew: .*Not a dir"
    ) as w:
        first = library_of(SOURCE, flags=FLAGS)
    assert len(w) == 1
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert library_of(SOURCE, flags=FLAGS) == first
        assert library_of(other(8), flags=FLAGS).parent == first.parent
        assert seven(load(SOURCE, flags=FLAGS)) == 7.0
