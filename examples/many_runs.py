# /// script
# requires-python = ">=3.11"
# dependencies = ["alight"]
# ///
"""An engineer's question: how hard can it strike, if my numbers are off by a tenth?

    python many_runs.py

Runs the arm of own_arm.toml with a thousand other bodies and contacts, and tells the spread of the
peak force, and which of the unknowns it follows.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

import alight

SCENARIO = Path(__file__).with_name("own_arm.toml")
UNKNOWN = ("plant.body.m", "plant.body.k_s", "plant.contact.K_I", "plant.arm.p1")
RUNS = 1000


def main() -> None:
    """Run the batch and print what it shows."""
    scenario = alight.load_scenario(SCENARIO)
    off = np.random.default_rng(0).uniform(0.9, 1.1, (len(UNKNOWN), RUNS))
    varied = {path: off[i] * value(scenario, path) for i, path in enumerate(UNKNOWN)}
    batch = alight.simulate_batch(scenario, varied)
    force = batch["peak_F_m"]
    low, middle, high = np.percentile(force, [5, 50, 95])
    print(f"{int(batch.completed.sum())} of {RUNS} runs reached their end")
    print(f"peak force {middle:.1f} N; 90 % of the runs between {low:.1f} and {high:.1f} N")
    for i, path in enumerate(UNKNOWN):
        print(f"correlation with {path}: {np.corrcoef(off[i], force)[0, 1]:+.2f}")


def value(scenario: alight.Scenario, path: str) -> float:
    """A number of a scenario by its path."""
    found: object = scenario
    for name in path.split("."):
        found = getattr(found, name)
    return float(found)  # type: ignore[arg-type]


if __name__ == "__main__":
    main()
