"""What is paid once: importing, building, compiling; and the memory of large batches."""

from __future__ import annotations

import tempfile
from typing import Any

from alight_benchmarks.own.bench import Bench
from alight_benchmarks.own.processes import seconds_of, told_by
from alight_benchmarks.own.ratios import spread

STARTS = {
    "python -c pass": "pass",
    "import alight": "import alight",
    "every public name": "import alight; [getattr(alight, name) for name in alight.__all__]",
    "its dependencies": "import casadi, numpy, scipy.integrate, pydantic, tomlkit, pyarrow",
    "alight --help": "import sys; sys.argv = ['alight', '--help']\n"
    "from alight.cli import main; main()",
}
BUILD = """
from alight.simulation.closed_loop import tick_program
from alight.kernels.compiled import FLAGS, source_of
from alight.kernels.lanes import kernel
from alight.kernels.lanes.source import source_of as lanes_of
from alight.kernels import toolchain
from alight.simulation.metrics import Gathering, chosen
from alight_benchmarks.own.problems import full
from pathlib import Path

toolchain.cache_folder = lambda: Path({folder!r})
loop = full().closed_loop

def timed(call):
    began = time.perf_counter()
    made = call()
    return made, time.perf_counter() - began

(program, building) = timed(lambda: tick_program(loop, None, loop.zeros()))
gathering = Gathering(chosen(None, loop.signals))
few = tick_program(loop, gathering.needs, loop.zeros())
source, _ = timed(lambda: source_of(program))
many, emitting = timed(lambda: lanes_of(few, gathering.fold(few.recorded), []))
_, compiling = timed(lambda: toolchain.load(source, flags=FLAGS))
_, compiling_lanes = timed(lambda: toolchain.load(many, flags=kernel.FLAGS))
_, loading = timed(lambda: toolchain.load(source, flags=FLAGS))
tell(building=building, emitting=emitting, compiling=compiling,
     compiling_lanes=compiling_lanes, loading=loading)
"""
BATCH = """
from alight_benchmarks.own.batch import batch_of
from alight_benchmarks.own.problems import full
batch_of(full({short}), 8)()
before = peak_memory()
batch_of(full({duration}), {runs})()
tell(before=before, after=peak_memory())
"""


def measure(bench: Bench) -> dict[str, Any]:
    """Times [s] and memory [bytes], each in processes of its own."""
    times = bench.pace.least + 2
    starts = {}
    for i, (name, code) in enumerate(STARTS.items()):
        bench.report(i / 8, name)
        starts[name] = spread(seconds_of(code, times))
    bare = starts["python -c pass"]["median"]
    bench.report(5 / 8, "building and compiling")
    with tempfile.TemporaryDirectory() as folder:
        once = told_by(BUILD.format(folder=folder))
    memory = []
    for duration, runs in ((10.0, bench.pace.runs), (0.05, 100 * bench.pace.runs)):
        bench.report((6 + len(memory)) / 8, f"memory of {runs} runs")
        found = told_by(BATCH.format(short=duration, duration=duration, runs=runs))
        memory.append({"runs": runs, "duration": duration, **found})
    return {
        "starts": starts,
        "import_alight": starts["import alight"]["median"] - bare,
        "once": once,
        "memory": memory,
    }
