# /// script
# requires-python = ">=3.11"
# dependencies = ["alight", "numpy"]
# ///
"""A law in ordinary Python: any code on floats and arrays, without expressions.

    python plain_python_law.py

Such a law is simulated, recorded and compared like any other; only compilation and export need
a law on expressions.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

import alight
from alight.symbolic.signals import Signal

SCENARIO = Path(__file__).with_name("own_arm.toml")


class Approach(alight.PlainLaw):
    """Creeps towards the body at a set speed, then presses it to the set point."""

    states: ClassVar = {
        "touched": Signal("", "1 once the body has moved"),
        "push": Signal("N", "force that presses the body"),
    }
    signals: ClassVar = {"e_m": Signal("m", "position error of the mass")}

    def __init__(
        self,
        scenario: alight.Scenario,
        speed: float = 0.2,
        stiffness: float = 400.0,
        pressing: float = 3000.0,
        damping: tuple[float, float] = (120.0, 60.0),
    ) -> None:
        self.arm, self.target = scenario.plant.arm, scenario.target
        self.x_0 = scenario.plant.body.x_0
        self.speed, self.stiffness, self.pressing = speed, stiffness, pressing
        self.damping = np.array(damping)

    def initial_state(self) -> Mapping[str, Any]:
        """Nothing touched, nothing pressed."""
        return {"touched": 0.0, "push": 0.0}

    def tick(
        self, state: Mapping[str, Any], measured: alight.Measurement, dt: float
    ) -> alight.Tick:
        """Speed control along X1 until the body moves, force control from then on."""
        x_r = self.arm.x_r(measured.q)
        J = self.arm.J(measured.q)
        x_r_dot = J @ measured.q_dot
        e_m = self.target.x_md - measured.x_m
        touched = state["touched"] or float(measured.x_m > self.x_0 + 1e-4)

        F = self.damping * (np.array([self.speed, 0.0]) - x_r_dot)
        F[1] += self.stiffness * (self.target.x_rd2 - x_r[1])
        push = state["push"]
        if touched:
            push += dt * self.pressing * e_m
            F[0] = push - self.damping[0] * x_r_dot[0]
        following = {"touched": touched, "push": push}
        return alight.Tick(tau=J.T @ F, state=following, signals={"e_m": e_m})


def main() -> None:
    """Run the law on the arm of own_arm.toml."""
    scenario = alight.load_scenario(SCENARIO, {"testbed.sample_rate": 1000.0, "duration": 2.5})
    run = alight.simulate(scenario, law=Approach(scenario))
    contact = run.t[run["Lambda"] > 0]
    print(run.verdict)
    print(f"first contact    {contact[0]:.3f} s" if len(contact) else "no contact")
    print(f"peak force       {run.peak('F_m'):.1f} N")
    print(f"peak torques     {run.peak('tau').round(2)} N m")
    print(f"|e_m| at the end {1e3 * run.last(0.5).peak('e_m'):.3f} mm")


if __name__ == "__main__":
    main()
