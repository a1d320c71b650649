"""The error of a batch's steps against the tight reference, and that of plain steps beside it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

import alight
from alight import Scenario
from alight.simulation.sampled_reference import sampled_reference
from alight_benchmarks.own import plain
from alight_benchmarks.own.bench import Bench
from alight_benchmarks.own.problems import PLAIN_SUBSTEPS, full, ideal

STEPS = (1, 2, 4, 8)
"""Steps in a sample; in a hurry without the last number."""
CHANNELS = ("q", "x_m", "F_m")
SCENARIOS = (ideal, full)


def measure(bench: Bench) -> dict[str, Any]:
    """Largest error of each channel over the first impacts, at several numbers of steps."""
    duration, rows = bench.pace.accuracy, []
    for i, made in enumerate(SCENARIOS):
        scenario = made(duration)
        bench.report(i / len(SCENARIOS), f"accuracy on {scenario.name}")
        default = scenario.closed_loop.substeps
        run = sampled_reference(scenario.closed_loop, scenario.start, duration)
        exact = {channel: run[channel] for channel in CHANNELS}
        for steps in STEPS[:-1] if bench.quick else STEPS:
            found = {
                True: (_errors(_batch(made(duration, steps)), exact), default),
                False: (_errors(_plain(scenario, steps), exact), PLAIN_SUBSTEPS),
            }
            for how, (errors, usual) in found.items():
                row = {"scenario": scenario.name, "steps": steps, "located": how}
                rows.append({**row, "usual": steps == usual, "error": errors})
    return {"rows": rows, "duration": duration}


def _batch(scenario: Scenario) -> dict[str, np.ndarray]:
    """Signals of a run as a batch makes it."""
    nominal = {"plant.body.m": np.array([scenario.plant.body.m])}
    batch = alight.simulate_batch(scenario, nominal, metrics=(), channels=CHANNELS)
    return {channel: batch[channel][0] for channel in CHANNELS}


def _plain(scenario: Scenario, steps: int) -> dict[str, np.ndarray]:
    samples = plain.prepared(scenario, substeps=steps, channels=CHANNELS).call()
    return {"q": samples[:, :2], "x_m": samples[:, 2], "F_m": samples[:, 3]}


def _errors(
    found: Mapping[str, np.ndarray], exact: Mapping[str, np.ndarray]
) -> dict[str, float | None]:
    """Largest error of each channel; None where a run left the numbers, or ended early."""
    errors: dict[str, float | None] = {}
    for channel, values in found.items():
        same = len(values) == len(exact[channel])
        off = float(np.abs(values - exact[channel]).max()) if same else np.inf
        errors[channel] = off if np.isfinite(off) else None
    return errors
