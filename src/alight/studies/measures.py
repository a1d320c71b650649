"""The figures of a run that the paper's claims speak of."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from alight.scenarios import Scenario, simulate
from alight.simulation import Recording
from alight.simulation.metrics import metrics_of

METRICS = (
    "steady_e_r",
    "steady_e_m",
    "mean_e_r",
    "mean_e_m",
    "peak_tau",
    "peak_F_m",
    "chatter",
    "least_clearance",
    "settling",
)
CHANNELS = ("e_m", "e_r", "F_m", "tau", "probe_clearance", "theta_dk_hat", "x_m")


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
    """Take the figures of a recording of a scenario; a run that ended early has no steady state."""
    document, dt = scenario.document, scenario.closed_loop.dt
    figures = metrics_of(
        recording,
        METRICS,
        dt=dt,
        ticks=round(document.duration / dt),
        steady_state=document.steady_state,
        travel=abs(scenario.target.x_md - scenario.plant.body.x_0),
    )
    tau1, tau2 = figures["peak_tau"]
    e_r1, e_r2 = figures["steady_e_r"]
    return Measures(
        completed=recording.verdict.completed,
        time=recording.verdict.time,
        e_r1=float(e_r1),
        e_r2=float(e_r2),
        e_m=figures["steady_e_m"],
        mean_e_r1=float(figures["mean_e_r"][0]),
        mean_e_m=figures["mean_e_m"],
        tau=(float(tau1), float(tau2)),
        F_m=figures["peak_F_m"],
        chatter=figures["chatter"],
        deflection=scenario.testbed.probe.clearance - figures["least_clearance"],
        clearance=figures["least_clearance"],
        settling=figures["settling"],
        mismatch=_mismatch(recording, scenario),
    )


def _mismatch(recording: Recording, scenario: Scenario) -> float | None:
    """Mean steady-state part of the desired position that the estimate of ``theta_dk`` errs by."""
    if "theta_dk_hat" not in recording:
        return None
    end = recording.last(scenario.document.steady_state)
    error = end["theta_dk_hat"] - scenario.plant.theta_dk
    return float(np.mean(error * scenario.plant.body.Y_d(end["x_m"])))


def run_and_measure(scenario: Scenario, seed: int | None = None) -> Measures:
    """Run a scenario, with another seed of the noise if given, and take its figures."""
    channels = tuple(name for name in CHANNELS if name in scenario.closed_loop.signals)
    return measure(simulate(scenario, seed=seed, channels=channels), scenario)
