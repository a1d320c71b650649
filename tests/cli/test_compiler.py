"""With and without a compiler everything works, and one line says what was done or lost."""

from __future__ import annotations

import json
import os
import pty
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from alight.kernels.compilers import CompilerUnavailable, find_compiler
from tests.cli.command import OWN_ARM, SHORT, environment, invoke, process
from tests.kernels.compilers import broken_compilers, script, waiting_compiler

RUN = ("run", OWN_ARM, "--set", "duration=1.2", *SHORT[2:], "--set", "substeps=1", "--json")
"""Longer than the ticks after which compiling is considered."""
SLOWER = "note: runs in CasADi's virtual machine, several times slower: "
WORTH_IT = """
import sys
from alight.kernels import auto, compilers, toolchain
auto.COMPILED_PER_SECOND = 1e12
"""
"""As if compiling cost nothing: what a run of minutes finds worth its while, a short one does."""
WITHOUT_ZIG = 'sys.modules["ziglang"] = None\n'


def compiler() -> str | None:
    """The compiler of this machine, as ``$CC`` names it."""
    try:
        return shlex.join(find_compiler().command)
    except CompilerUnavailable:
        return None


NEEDS_COMPILER = pytest.mark.skipif(compiler() is None, reason="no C compiler on this machine")


@pytest.fixture(scope="module")
def figures() -> dict[str, object]:
    return json.loads(invoke(*RUN, "--backend", "vm").stdout)


def run(*args: str, before: str = WORTH_IT, **env: str | None) -> subprocess.CompletedProcess[str]:
    """``alight`` as a process of its own, with some lines of Python run before it."""
    code = f"{before}\nfrom alight.cli import main; main()"
    return subprocess.run(
        [sys.executable, "-P", "-c", code, *args],
        env=environment(**env),
        capture_output=True,
        text=True,
        check=False,
        timeout=300,
    )


def check(done: subprocess.CompletedProcess[str], figures: dict[str, object], line: str) -> None:
    """The same figures, and nothing but one line."""
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == figures
    assert line in done.stderr
    assert done.stderr.count("\n") == (1 if line else 0)


def libraries(folder: Path) -> list[Path]:
    return list((folder / "alight").glob("*.so"))


# With a compiler


@NEEDS_COMPILER
def test_long_work_is_compiled_and_the_next_process_finds_it(figures, tmp_path):
    env = {"XDG_CACHE_HOME": str(tmp_path), "CC": compiler()}
    check(run(*RUN, **env), figures, "")
    (library,) = libraries(tmp_path)
    built = library.stat().st_mtime_ns
    check(run(*RUN, before="", **env), figures, "")
    assert libraries(tmp_path) == [library] and library.stat().st_mtime_ns == built


def test_a_short_run_is_not_compiled(figures, tmp_path):
    done = run(*RUN, before="", XDG_CACHE_HOME=str(tmp_path))
    check(done, figures, "")
    assert not libraries(tmp_path)


@NEEDS_COMPILER
def test_on_a_terminal_one_line_says_that_it_compiles(tmp_path):
    env = environment(XDG_CACHE_HOME=str(tmp_path), CC=compiler(), COLUMNS="200")
    ours, theirs = pty.openpty()
    code = f"{WORTH_IT}\nfrom alight.cli import main; main()"
    with subprocess.Popen(
        [sys.executable, "-P", "-c", code, *RUN], env=env, stdout=subprocess.PIPE, stderr=theirs
    ) as child:
        os.close(theirs)
        shown = b""
        try:
            while part := os.read(ours, 4096):
                shown += part
        except OSError:  # the terminal is closed: all of it was read
            pass
    os.close(ours)
    assert child.returncode == 0
    assert shown.decode().count("note: ") == 1
    assert f"note: compiling with {find_compiler().name}" in shown.decode()
    assert f"kept in {tmp_path}/alight" in shown.decode()


# Without


def test_without_a_compiler(figures, tmp_path):
    done = run(*RUN, before=WORTH_IT + WITHOUT_ZIG, PATH="", CC=None, XDG_CACHE_HOME=str(tmp_path))
    check(done, figures, f"{SLOWER}no C compiler (cc, gcc, clang) is on the path")


@pytest.mark.parametrize("how", ["failing", "babbling", "not a program"])
def test_with_a_compiler_that_does_not_work(figures, tmp_path, how):
    chosen, _ = broken_compilers(tmp_path)[how]
    done = run(*RUN, CC=chosen, XDG_CACHE_HOME=str(tmp_path / "cache"))
    check(done, figures, SLOWER)
    assert Path(chosen).name in done.stderr or "cannot be loaded" in done.stderr


def test_with_a_compiler_that_hangs(figures, tmp_path):
    done = run(
        *RUN,
        before=f"{WORTH_IT}toolchain.BUILD_LIMIT = 0.5\n",
        CC=waiting_compiler(tmp_path),
        XDG_CACHE_HOME=str(tmp_path / "cache"),
    )
    check(done, figures, f"{SLOWER}{tmp_path}/cc-waits was not done after 0.5 s")


@NEEDS_COMPILER
def test_with_a_cache_folder_that_cannot_be_written(figures, tmp_path):
    (tmp_path / "file").write_text("")
    done = run(*RUN, CC=compiler(), XDG_CACHE_HOME=str(tmp_path / "file"))
    check(done, figures, "note: compiled programs are not kept, so that each process compiles anew")


def test_who_insists_on_c_is_told_what_is_missing(tmp_path):
    done = run(
        *(*RUN, "--backend", "c"),
        before=f"import sys\n{WITHOUT_ZIG}",
        PATH="",
        CC=None,
        XDG_CACHE_HOME=str(tmp_path),
    )
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == (
        "error: no C compiler (cc, gcc, clang) is on the path, nor is ziglang installed "
        "(pip install 'alight[zig]')\n"
    )


def test_who_chooses_the_virtual_machine_is_told_nothing(figures, tmp_path):
    broken = script(tmp_path / "cc", f"touch {tmp_path}/asked", "exit 1")
    env = environment(CC=broken, XDG_CACHE_HOME=str(tmp_path / "cache"))
    done = process(*RUN, "--backend", "vm", env=env)
    check(done, figures, "")
    assert not (tmp_path / "cache").exists() and not (tmp_path / "asked").exists()
