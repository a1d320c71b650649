# /// script
# requires-python = ">=3.11"
# dependencies = ["alight"]
# ///
"""An engineer with an arm and a limit in newtons: the largest reach k2 that keeps the limit.

    python own_arm.py

The arm, the body and the first choice of the gains stand in own_arm.toml.
"""

from __future__ import annotations

from pathlib import Path

import alight

SCENARIO = Path(__file__).with_name("own_arm.toml")
LIMIT = 30.0
"""Largest contact force that the body endures [N]."""


def main() -> None:
    """Try values of k2, (25): a longer reach gets there sooner and strikes harder."""
    print("  k2 [m]   first contact [s]   peak force [N]   |e_m| at the end [mm]")
    for k2 in (0.05, 0.1, 0.2, 0.4):
        scenario = alight.load_scenario(SCENARIO, {"law.gains.k2": k2})
        run = alight.simulate(scenario)
        contact = run.t[run["Lambda"] > 0]
        force = run.peak("F_m")
        error = run.last(scenario.document.steady_state).peak("e_m")
        print(
            f"{k2:8.2f} {contact[0]:19.3f} {force:16.1f} {1e3 * error:23.3f}"
            f"   {'above the limit' if force > LIMIT else ''}".rstrip()
        )


if __name__ == "__main__":
    main()
