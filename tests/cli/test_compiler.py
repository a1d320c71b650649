"""Without a compiler everything works, and one line says what was lost."""

from __future__ import annotations

import json
import subprocess

import pytest

from alight.kernels.compiled import CompilerUnavailable, find_compiler
from tests.cli.command import OWN_ARM, SHORT, environment, invoke, process

RUN = ("run", OWN_ARM, *SHORT, "--json")
SLOWER = "note: runs in CasADi's virtual machine, several times slower: "


def compiler() -> str | None:
    try:
        return find_compiler()
    except CompilerUnavailable:
        return None


@pytest.fixture(scope="module")
def figures() -> dict[str, object]:
    return json.loads(invoke(*RUN).stdout)


def check(done: subprocess.CompletedProcess[str], figures: dict[str, object], why: str) -> None:
    """The same figures, and one line that says why they took longer."""
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == figures
    assert done.stderr.startswith(SLOWER) and why in done.stderr
    assert done.stderr.count("\n") == 1


def test_without_a_compiler(figures, tmp_path):
    env = environment(PATH="", CC=None, XDG_CACHE_HOME=str(tmp_path))
    check(process(*RUN, env=env), figures, "no C compiler (cc, gcc, clang) is on the path")


def test_with_a_compiler_that_does_not_work(figures, tmp_path):
    compiler = tmp_path / "cc"
    compiler.write_text("#!/bin/sh\necho 'a first line' >&2\necho 'a second line' >&2\nexit 1\n")
    compiler.chmod(0o755)
    env = environment(CC=str(compiler), XDG_CACHE_HOME=str(tmp_path / "cache"))
    check(process(*RUN, env=env), figures, "failed: a first line a second line")


def test_with_a_cache_folder_that_cannot_be_written(figures, tmp_path):
    (tmp_path / "file").write_text("")
    compiler = tmp_path / "cc"
    compiler.write_text("#!/bin/sh\necho 'compiler 1.0'\n")
    compiler.chmod(0o755)
    env = environment(CC=str(compiler), XDG_CACHE_HOME=str(tmp_path / "file" / "cache"))
    check(process(*RUN, env=env), figures, "cannot build in ")


@pytest.mark.skipif(compiler() is None, reason="no C compiler on this machine")
def test_with_a_program_in_the_cache_that_is_damaged(figures, tmp_path):
    env = environment(XDG_CACHE_HOME=str(tmp_path))
    first = process(*RUN, env=env)
    assert (first.returncode, first.stderr) == (0, "")
    assert json.loads(first.stdout) == figures
    (library,) = (tmp_path / "alight").iterdir()
    library.write_bytes(b"no program")
    check(process(*RUN, env=env), figures, f"{library}: ")


def test_who_insists_on_c_is_told_what_is_missing(tmp_path):
    env = environment(PATH="", CC=None, XDG_CACHE_HOME=str(tmp_path))
    done = process(*RUN, "--backend", "c", env=env)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "error: no C compiler (cc, gcc, clang) is on the path\n"


def test_who_chooses_the_virtual_machine_is_told_nothing(figures, tmp_path):
    env = environment(PATH="", CC=None, XDG_CACHE_HOME=str(tmp_path))
    done = process(*RUN, "--backend", "vm", env=env)
    assert (done.returncode, done.stderr) == (0, "")
    assert json.loads(done.stdout) == figures
    assert list(tmp_path.iterdir()) == []
