# /// script
# requires-python = ">=3.11"
# dependencies = ["alight"]
# ///
"""A researcher's own law: one class, then simulation and comparison come for nothing.

    python own_law.py

The class can also be named in a scenario file, `type = "own_law:Softsign"` under `[law]`, or on the
command line: `alight run own_arm.toml --set law.type=own_law:Softsign`.
"""

from __future__ import annotations

from pathlib import Path

import alight
from alight.symbolic.ops import Vector, as_vector, fabs

SCENARIO = Path(__file__).with_name("own_arm.toml")


class Softsign(alight.AdaptiveContactLaw):
    """The adaptive law with another saturation: r / (1 + |r|), which bends earlier than tanh."""

    def feedback(self, e_r: Vector, r_r: Vector) -> Vector:
        """Feedback force [N], below 1 + k3 on each axis."""
        return e_r / (1 + fabs(e_r)) + as_vector(self.gains.k3) * r_r / (1 + fabs(r_r))


def main() -> None:
    """Compare the laws on the arm of own_arm.toml, under the same gains."""
    scenario = alight.load_scenario(SCENARIO)
    for law in (alight.ForceLimiting, Softsign, alight.Unsaturated):
        run = alight.simulate(scenario, law=law)
        feedback = run["F"] - run["F_feedforward"]
        print(
            f"{law.__name__:14} {run.verdict}; peak contact force {run.peak('F_m'):.1f} N, "
            f"peak feedback force {abs(feedback[:, 0]).max():.1f} N, "
            f"|e_m| at the end {1e3 * run.last(1.0).peak('e_m'):.3f} mm"
        )


if __name__ == "__main__":
    main()
