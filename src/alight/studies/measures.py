"""The figures of a run that the paper's claims speak of."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from alight.scenarios import Scenario, simulate
from alight.simulation import Recording

CHANNELS = (
    "e_m",
    "e_r",
    "F_m",
    "tau",
    "probe_clearance",
    "theta_dk_hat",
    "x_m",
)
SETTLED = 0.05
"""A run has settled when ``e_m`` stays within this share of the travel ``x_md - x_0``."""


@dataclass(frozen=True)
class Measures:
    """Figures of one run; steady-state values are taken over the scenario's last part."""

    completed: bool
    time: float
    """Length of the run [s]."""
    e_r1: float
    """Peak steady-state error of the tip along X1, as measured [m]."""
    e_r2: float
    """Peak steady-state error of the tip along X2, as measured [m]."""
    e_m: float
    """Peak steady-state error of the mass, as measured [m]."""
    mean_e_r1: float
    """Mean steady-state error of the tip along X1 [m]."""
    mean_e_m: float
    """Mean steady-state error of the mass; positive when it lies short of the set point [m]."""
    tau: tuple[float, float]
    """Peak computed torques [N m]."""
    F_m: float
    """Peak impact force [N]."""
    chatter: float
    """Standard deviation of the steady-state contact force over its mean."""
    deflection: float
    """Peak deflection of the stiff spring [m]."""
    clearance: float
    """Least clearance at the probe [m]; zero or below when the plate touches it."""
    settling: float
    """Time after which ``e_m`` stays within 5 % of the travel [s]."""
    mismatch: float | None
    """Mean steady-state ``(theta_dk_hat - theta_dk) Y_d`` [m]; none where nothing is estimated."""


def measure(recording: Recording, scenario: Scenario) -> Measures:
    """Take the figures of a recording of a scenario."""
    end = recording.last(scenario.document.steady_state)
    travel = abs(scenario.target.x_md - scenario.plant.body.x_0)
    outside = np.abs(recording["e_m"]) > SETTLED * travel
    mismatch = None
    if "theta_dk_hat" in recording:
        error = end["theta_dk_hat"] - scenario.plant.theta_dk
        mismatch = float(np.mean(error * scenario.plant.body.Y_d(end["x_m"])))
    tau1, tau2 = recording.peak("tau")
    least = float(recording["probe_clearance"].min())
    return Measures(
        completed=recording.verdict.completed,
        time=recording.verdict.time,
        e_r1=end.peak("e_r1"),
        e_r2=end.peak("e_r2"),
        e_m=end.peak("e_m"),
        mean_e_r1=float(np.mean(end["e_r1"])),
        mean_e_m=float(np.mean(end["e_m"])),
        tau=(float(tau1), float(tau2)),
        F_m=recording.peak("F_m"),
        chatter=float(np.std(end["F_m"]) / max(np.mean(end["F_m"]), np.finfo(float).tiny)),
        deflection=scenario.testbed.probe.clearance - least,
        clearance=least,
        settling=float(recording.t[np.flatnonzero(outside)[-1]]) if outside.any() else 0.0,
        mismatch=mismatch,
    )


def run_and_measure(scenario: Scenario, seed: int | None = None) -> Measures:
    """Run a scenario, with another seed of the noise if given, and take its figures."""
    channels = tuple(name for name in CHANNELS if name in scenario.closed_loop.signals)
    return measure(simulate(scenario, seed=seed, channels=channels), scenario)
