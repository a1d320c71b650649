"""A batch of runs on one core: with ideal sensors against R, with everything against R'."""

from __future__ import annotations

from functools import partial
from typing import Any

from alight import Scenario
from alight.scenarios.simulate_batch import Batch, simulate_batch
from alight_benchmarks.own import plain
from alight_benchmarks.own.bench import Bench
from alight_benchmarks.own.problems import full, ideal, varied
from alight_benchmarks.own.ratios import Kept, Work, compared

DURATION = 10.0
SIZES = (1, 8, 64)
"""Numbers of runs beside that of the pace."""


def measure(bench: Bench) -> dict[str, Any]:
    """Time of a run in batches of several sizes, all metrics gathered, one thread."""
    everything = full(DURATION)
    noisy = Work(plain.prepared(everything, metrics=True).call, DURATION)
    sizes = sorted({*SIZES, bench.pace.runs})
    cases = [(ideal(DURATION), n, bench.reference, "R") for n in sizes]
    cases.append((everything, bench.pace.runs, noisy, "R'"))
    rows = []
    for i, (scenario, runs, base, unit) in enumerate(cases):
        bench.report(i / len(cases), f"batch of {runs}")
        run = Kept(batch_of(scenario, runs))
        figures = compared(Work(run, runs * DURATION), base, bench.pace)
        rows.append(
            {
                "scenario": scenario.name,
                "steps": scenario.closed_loop.substeps,
                "runs": runs,
                "completed": int(run.latest.completed.sum()),
                "unit": unit,
                **figures,
            }
        )
    plain_full = compared(noisy, bench.reference, bench.pace)
    return {"rows": rows, "full_per_ideal": plain_full["ratio"]}


def batch_of(scenario: Scenario, runs: int, threads: int = 1) -> partial[Batch]:
    """A batch of varied plants, and of seeds where there is noise, with all metrics."""
    noisy = scenario.testbed.transducer.noise > 0
    values = varied(scenario, runs, seeds=noisy)
    return partial(simulate_batch, scenario, values, backend="c", threads=threads)
