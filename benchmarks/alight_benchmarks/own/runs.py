"""One run of Alight, compiled and in CasADi's virtual machine."""

from __future__ import annotations

from functools import partial
from typing import Any

import alight
from alight_benchmarks.own import plain
from alight_benchmarks.own.bench import Bench
from alight_benchmarks.own.problems import full, ideal
from alight_benchmarks.own.ratios import Work, compared

FEW = ("q", "x_m")
DURATION = 10.0


def measure(bench: Bench) -> dict[str, Any]:
    """Time of a run as a multiple of plain C that does the same."""
    loop = ideal(DURATION)
    everything = full(DURATION)
    plain_all = Work(plain.prepared(everything, channels=None).call, DURATION)
    plain_few = Work(plain.prepared(everything, channels=FEW).call, DURATION)
    rows = []
    cases = (
        (loop, FEW, "c", bench.reference, "R"),
        (loop, None, "c", bench.reference, "R"),
        (loop, FEW, "lanes", bench.reference, "R"),
        (loop, None, "lanes", bench.reference, "R"),
        (loop, FEW, "vm", bench.reference, "R"),
        (everything, FEW, "c", plain_few, "R'"),
        (everything, None, "c", plain_all, "R'"),
        (everything, FEW, "lanes", plain_few, "R'"),
        (everything, None, "lanes", plain_all, "R'"),
        (everything, FEW, "vm", plain_few, "R'"),
    )
    for scenario, channels, backend, base, unit in cases:
        bench.report(len(rows) / len(cases), f"one run of {scenario.name}, {backend}")
        run = partial(alight.simulate, scenario, channels=channels, backend=backend)
        rows.append(
            {
                "backend": backend,
                "scenario": scenario.name,
                "steps": scenario.closed_loop.substeps,
                "channels": "all" if channels is None else ", ".join(channels),
                "unit": unit,
                **compared(Work(run, DURATION), base, bench.pace),
            }
        )
    return {"rows": rows}
