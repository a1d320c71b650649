"""A batch by numbers of lanes and by compilers; each compiler in a process of its own."""

from __future__ import annotations

import shlex
import subprocess
from functools import partial
from typing import Any

from alight.kernels.compilers import Compiler, compilers
from alight.scenarios.simulate_batch import simulate_batch
from alight_benchmarks.own.bench import Bench, reference
from alight_benchmarks.own.problems import ideal, varied
from alight_benchmarks.own.processes import told_by
from alight_benchmarks.own.ratios import FULL, QUICK, Work, compared

WIDTHS = (1, 2, 4, 8)
RUNS = 64
DURATION = 10.0


def measure(bench: Bench) -> dict[str, Any]:
    """Time of a run for each number of lanes, by each compiler there is."""
    found = _by_version()
    rows: list[dict[str, Any]] = []
    for i, (name, compiler) in enumerate(found.items()):
        bench.report(i / len(found), f"lanes by {name}")
        code = f"from alight_benchmarks.own.lanes import widths; tell(rows=widths({bench.quick}))"
        try:
            told = told_by(code, CC=shlex.join(compiler.command))
        except subprocess.CalledProcessError:  # a broken compiler must not take the others with it
            told = {"rows": [{"failed": True}]}
        rows += [{"compiler": name, **row} for row in told["rows"]]
    return {"rows": rows, "runs": RUNS}


def _by_version() -> dict[str, Compiler]:
    """Compilers by version."""
    found: dict[str, Compiler] = {}
    for compiler in compilers():
        version = compiler.version.splitlines()[0]
        found.setdefault(f"ziglang {version}" if compiler.is_zig else version, compiler)
    return found


def widths(quick: bool) -> list[dict[str, Any]]:
    """Time of a run for each number of lanes, by the compiler that ``CC`` names."""
    scenario, pace = ideal(DURATION), QUICK if quick else FULL
    values = varied(scenario, RUNS, seeds=False)
    rows = []
    for width in WIDTHS:
        run = partial(simulate_batch, scenario, values, backend="c", threads=1, width=width)
        figures = compared(Work(run, RUNS * DURATION), reference(), pace)
        rows.append({"width": width, **figures})
    return rows
