"""``alight bench``: it runs to its end, refuses wrong names, and writes its files whole."""

from __future__ import annotations

import json
import os

import pytest

from alight.kernels.compilers import CompilerUnavailable, find_compiler
from alight.tables import markdown
from alight_benchmarks.generated import COMPILERS
from alight_benchmarks.own.machine import CAN_PIN, ONE_THREAD
from alight_benchmarks.own.report import tables
from tests.cli.command import environment, invoke, process

QUICK = ("bench", "--quick", "--only", "numpy", "--only", "runs")


def has_compiler() -> bool:
    try:
        return find_compiler().name.rpartition("/")[2] in COMPILERS
    except CompilerUnavailable:
        return False


NEEDS_COMPILER = pytest.mark.skipif(not has_compiler(), reason="no C compiler on this machine")


@NEEDS_COMPILER
def test_a_quick_benchmark_prints_its_tables_and_keeps_them(tmp_path):
    done = process(*QUICK, "--out", str(tmp_path / "kept"))
    assert (done.returncode, done.stderr) == (0, "")
    for part in ("Machine", "Peers on the same closed loop", "One run of Alight", "Budget"):
        assert part in done.stdout
    assert "C, scalar (R)" in done.stdout and "virtual machine" in done.stdout
    kept = json.loads((tmp_path / "kept" / "benchmarks.json").read_text("utf-8"))
    assert sorted(path.name for path in (tmp_path / "kept").iterdir()) == [
        *("benchmarks.json", "benchmarks.md")
    ]
    assert (tmp_path / "kept" / "benchmarks.md").read_text("utf-8") == markdown(tables(kept))
    assert kept["quick"] and kept["command"] == "alight " + " ".join(
        QUICK[:1] + QUICK[2:] + QUICK[1:2]
    )
    assert set(kept["sections"]) == {"peers", "runs"}
    for row in kept["sections"]["peers"]["rows"]:
        assert row["ratio"]["low"] > 0 and row["same"]


@NEEDS_COMPILER
def test_json_is_all_that_json_prints():
    done = process("bench", "--quick", "--only", "law", "--json")
    assert (done.returncode, done.stderr) == (0, "")
    found = json.loads(done.stdout)
    assert set(found["sections"]) == {"law"}
    assert found["sections"]["law"]["trip"] == 0
    (line,) = found["budget"]
    assert line["limit"] == 1.6


def test_a_wrong_name_is_refused_with_those_there_are():
    result = invoke("bench", "--only", "matlab")
    assert result.exit_code == 2 and result.stdout == ""
    for name in ("'matlab'", "numpy", "drake", "batch", "accuracy"):
        assert name in result.stderr


def test_without_a_compiler_it_says_that_it_needs_one(tmp_path):
    done = process(
        "bench", "--quick", "--only", "runs", env=environment(PATH=str(tmp_path), CC=None)
    )
    assert done.returncode == 2 and done.stdout == ""
    assert done.stderr.startswith("error: ") and "compiler" in done.stderr
    assert done.stderr.count("\n") == 1


def test_a_folder_that_takes_no_files_is_refused_before_anything_is_measured(tmp_path):
    (tmp_path / "file").touch()
    result = invoke("bench", "--out", str(tmp_path / "file"))
    assert result.exit_code == 2 and "is a file" in result.stderr


def test_the_process_is_left_as_it_was():
    """Of tests, of a notebook: the next thing done there has its cores back."""
    names = {name: os.environ.get(name) for name in ONE_THREAD}
    cores = os.sched_getaffinity(0) if CAN_PIN else None
    assert invoke("bench", "--only", "matlab").exit_code == 2
    assert {name: os.environ.get(name) for name in ONE_THREAD} == names
    assert not CAN_PIN or os.sched_getaffinity(0) == cores
