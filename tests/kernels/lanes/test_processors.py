"""The same kernel on other processors: what it compiles for, and that its results agree."""

from __future__ import annotations

import platform
import shutil
import subprocess
import sys
from importlib import util
from pathlib import Path

import numpy as np
import pytest

from alight.kernels.lanes import kernel
from alight.kernels.lanes.kernel import FLAGS, Lanes
from alight.kernels.lanes.source import source_of
from alight.kernels.program import Group, Program
from alight.scenarios import load_scenario
from alight.simulation.closed_loop import ClosedLoop, tick_program
from alight.simulation.metrics import Gathering, chosen
from tests.compiler import NEEDS_COMPILER
from tests.kernels.programs import noise_of
from tests.simulation.pushing import begin, pushing

zig = pytest.mark.skipif(util.find_spec("ziglang") is None, reason="ziglang is not installed")
TICKS = 600
ROUNDING = 1e-9
"""Of states after the impact, relative to their largest: products and sums are contracted on one
processor and not on another, and rounding grows through the impact."""


def abilities() -> str:
    try:
        return Path("/proc/cpuinfo").read_text("utf-8")
    except OSError:
        return ""


def on_x86(*needed: str) -> bool:
    return platform.machine() in ("x86_64", "AMD64") and all(
        f" {n} " in abilities() for n in needed
    )


def program_of(loop: ClosedLoop) -> tuple[Program, Gathering]:
    gathering = Gathering(chosen(None, loop.signals))
    return tick_program(loop, (*gathering.needs, "q"), loop.zeros()), gathering


LOOP = pushing()
PROGRAM, GATHERING = program_of(LOOP)
FOLD = GATHERING.fold(PROGRAM.recorded)
ENTRIES = list(range(*(lambda at: (at.start, at.stop))(PROGRAM.recorded.slices()["q"])))


def columns() -> tuple[np.ndarray, np.ndarray]:
    """States and parameters of eight runs of which each starts a little farther on."""
    shift = np.linspace(0, 1e-3, 8)
    x = np.asarray(LOOP.initial_column(begin(LOOP)), dtype=float).reshape(-1, 1) + np.zeros(8)
    x[0] += shift
    p = LOOP.parameter_values(LOOP.zeros())
    return x, np.repeat(np.array([*p, 0.75 * TICKS, 0.02])[:, None], 8, axis=1)


def run(lanes: Lanes) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """States, memories and rows of the eight runs, as many at a time as there are lanes."""
    x, p = columns()
    noise, parts = noise_of(TICKS).reshape(-1, 1), []
    for at in range(0, 8, lanes.width):
        some = slice(at, at + lanes.width)
        group: Group = lanes.group(x[:, some], p[:, some], GATHERING.start)
        rows = lanes.run(group, 0, noise, 7)
        assert group.alive.all() and (group.done == TICKS).all()
        parts.append((group.x, group.memory, rows))
    return tuple(np.concatenate(each, axis=-1) for each in zip(*parts, strict=True))


def assert_agree(a: tuple[np.ndarray, ...], b: tuple[np.ndarray, ...]) -> None:
    for one, other in zip(a, b, strict=True):
        scale = abs(one).reshape(*one.shape[:-1], 8).max(axis=-1, keepdims=True) + 1e-12
        assert np.max(abs(one - other) / scale) <= ROUNDING


FLAVOURS = {
    "AVX2": (("avx2", "fma"), 4, ("-mavx2", "-mfma")),
    "AVX-512": (("avx512f", "avx512dq"), 8, ("-mavx512f", "-mavx512dq", "-mfma")),
    "of 2003": ((), 1, ("-march=x86-64",)),
    "of 2003, in pairs": ((), 2, ("-march=x86-64",)),
}


@NEEDS_COMPILER
@pytest.mark.parametrize("flavour", FLAVOURS)
def test_every_kind_of_x86_gives_the_same_but_for_rounding(flavour, monkeypatch):
    needed, width, flags = FLAVOURS[flavour]
    if not on_x86(*needed):
        pytest.skip(f"this processor has no {flavour}")
    here = run(Lanes(PROGRAM, FOLD, ENTRIES, width=1))
    assert np.isfinite(here[0]).all() and here[0].std() > 0
    plain = tuple(f for f in FLAGS if f != "-march=native")
    monkeypatch.setattr(kernel, "FLAGS", (*plain, *flags))
    other = Lanes(PROGRAM, FOLD, ENTRIES, width=width)
    assert other.width == width
    assert_agree(here, run(other))


def zig_cc(folder: Path, source: str, *arguments: str) -> None:
    (folder / "code.c").write_text(source, "utf-8")
    told = ["-Wall", "-Wextra", "-Werror", "-Wno-unused-variable"]
    command = [sys.executable, "-m", "ziglang", "cc", *told, *arguments]
    done = subprocess.run([*command, "code.c"], cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-2000:]


TARGETS = {
    "aarch64-linux-gnu": ("-target", "aarch64-linux-gnu"),
    "aarch64-linux-musl": ("-target", "aarch64-linux-musl"),
    "aarch64-macos": ("-target", "aarch64-macos"),
    "scalar": ("-target", "x86_64-linux-gnu", "-mcpu=x86_64", "-DALIGHT_LANES=1"),
    "riscv64": ("-target", "riscv64-linux-musl"),
}


@zig
@pytest.mark.parametrize("target", ["aarch64-linux-gnu", "scalar"])
def test_a_small_kernel_compiles_for_other_processors(target, tmp_path):
    source = source_of(PROGRAM, FOLD, ENTRIES)
    zig_cc(tmp_path, source, *TARGETS[target], "-O1", "-c", "-o", "code.o")


@zig
@pytest.mark.slow
@pytest.mark.parametrize("target", TARGETS)
def test_the_kernel_of_the_paper_compiles_for_other_processors(target, tmp_path):
    loop = load_scenario("experiment-1").closed_loop
    program, gathering = program_of(loop)
    source = source_of(program, gathering.fold(program.recorded), ENTRIES)
    zig_cc(tmp_path, source, *TARGETS[target], "-O2", "-c", "-o", "code.o")


MAIN = """
#include <stdio.h>
static double numbers[8][NUMBERS] __attribute__((aligned(64)));
static int given(double *to, int count) { return fread(to, 8, count, stdin) == (size_t)count; }
static void told(const double *from, int count) { fwrite(from, 8, count, stdout); }
int main(void) {
  double *p = numbers[0], *noise = numbers[1], *x = numbers[2], *memory = numbers[3];
  double *alive = numbers[4], *done = numbers[5], *trip = numbers[6], *rows = numbers[7];
  if (!given(p, NP * LANES) || !given(noise, TICKS) || !given(x, NX * LANES)) return 1;
  if (!given(memory, NM * LANES)) return 1;
  V_EACH(lane) alive[lane] = 1;
  const Batch b = {TICKS, 0, 7, 1, p, noise, x, memory, alive, done, trip, rows};
  alight_batch(&b);
  told(x, NX * LANES), told(memory, NM * LANES), told(rows, NR * LANES * ROWS);
  return 0;
}
"""


@zig
@NEEDS_COMPILER
@pytest.mark.slow
@pytest.mark.skipif(shutil.which("qemu-aarch64-static") is None, reason="no emulator")
def test_two_lanes_of_aarch64_give_what_this_processor_gives(tmp_path):
    x, p = columns()
    count = -(-TICKS // 7)
    sizes = {"NP": len(p), "TICKS": TICKS, "ROWS": count, "NUMBERS": 1 << 16}
    source = source_of(PROGRAM, FOLD, ENTRIES) + MAIN
    defines = [f"-D{name}={value}" for name, value in sizes.items()]
    target = TARGETS["aarch64-linux-musl"]
    zig_cc(tmp_path, source, *target, *defines, "-O2", "-static", "-o", "program", "-lm")
    memory = np.repeat(GATHERING.start[:, None], 2, axis=1)
    parts = []
    for at in range(0, 8, 2):
        some = slice(at, at + 2)
        noise = noise_of(TICKS)
        told = b"".join(
            np.ascontiguousarray(v).tobytes() for v in (p[:, some], noise, x[:, some], memory)
        )
        emulated = ["qemu-aarch64-static", str(tmp_path / "program")]
        done = subprocess.run(emulated, input=told, capture_output=True, timeout=120)
        assert done.returncode == 0, done.stderr
        shapes = [(len(x), 2), (len(memory), 2), (count, len(ENTRIES), 2)]
        ends = np.cumsum([int(np.prod(s)) for s in shapes])[:-1]
        found = np.split(np.frombuffer(done.stdout), ends)
        parts.append([v.reshape(s) for v, s in zip(found, shapes, strict=True)])
    emulated_runs = tuple(np.concatenate(each, axis=-1) for each in zip(*parts, strict=True))
    assert_agree(run(Lanes(PROGRAM, FOLD, ENTRIES, width=1)), emulated_runs)
