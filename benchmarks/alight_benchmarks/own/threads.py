"""A batch over threads."""

from __future__ import annotations

from typing import Any

from alight_benchmarks.own.batch import batch_of
from alight_benchmarks.own.bench import Bench
from alight_benchmarks.own.machine import cores, on_processors
from alight_benchmarks.own.problems import ideal
from alight_benchmarks.own.ratios import Work, compared

DURATION = 10.0


def measure(bench: Bench) -> dict[str, Any]:
    """Rate of two threads, and of as many as there are processors, over that of one."""
    allowed, rows = bench.processors, []
    counts = sorted({2, len(allowed)}) if len(allowed) > 1 else []
    with on_processors(allowed):
        one = batch_of(ideal(DURATION), bench.pace.runs)
        for i, threads in enumerate(counts):
            bench.report(i / len(counts), f"{threads} threads")
            many = batch_of(ideal(DURATION), bench.pace.runs, threads)
            rate = compared(Work(one), Work(many), bench.pace)["ratio"]
            rows.append({"threads": threads, "rate": rate})
    return {"rows": rows, "processors": len(allowed), "cores": cores(allowed)}
