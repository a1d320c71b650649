"""The problem that every peer solves, and what a peer is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from importlib import metadata, resources

import numpy as np

from alight import Scenario, load_scenario

RECORD_EVERY = 20
"""Samples of the law between two rows of what a peer returns."""

Pair = tuple[float, float]
Run = Callable[[], np.ndarray]
"""One whole run; rows of ``[q1, q2, x_m]``, see `Peer.prepare`."""


@dataclass(frozen=True)
class Box:
    """An estimate with its projection: start, bounds, layer and leak."""

    initial: float | tuple[float, ...]
    lower: float | tuple[float, ...]
    upper: float | tuple[float, ...]
    margin: float
    leak: float


@dataclass(frozen=True)
class Numbers:
    """Every number of the problem under the paper's symbols, SI units, no object of Alight."""

    l1: float
    l2: float
    p1: float
    p2: float
    p3: float
    m: float | np.ndarray
    """An array over the runs of a batch, see `varied`."""
    k_s: float | np.ndarray
    x_0: float
    K_I: float
    x_md: float
    x_rd2: float
    k1: float
    k2: float
    k3: Pair
    alpha1: float
    alpha2: float
    alpha3: float
    alpha: Pair
    Gamma: float
    Gamma_r: tuple[float, ...]
    theta_dk: Box
    theta_r: Box
    tau_max: Pair
    q0: Pair
    x_m0: float
    e_f0: float


@cache
def problem_scenario(duration: float = 10.0, substeps: int = 4) -> Scenario:
    """Return the problem as a scenario of Alight."""
    overrides = {
        "duration": duration,
        "steady_state": min(2.0, duration),
        "substeps": substeps,
    }
    with resources.as_file(resources.files(__package__) / "problem.toml") as path:
        return load_scenario(path, overrides)


@dataclass(frozen=True)
class Problem:
    """The numbers, how long to run, and how finely."""

    numbers: Numbers
    duration: float
    """Length of a run [s]."""
    sample_rate: float
    """Rate of the sampled law [Hz]."""
    substeps: int
    """Runge-Kutta steps of the plant in a sample."""

    @classmethod
    def load(cls, duration: float = 10.0) -> Problem:
        """Read the numbers from the scenario."""
        scenario = problem_scenario(duration)
        rate, substeps = scenario.testbed.sample_rate, scenario.document.substeps
        return cls(numbers_of(scenario), duration, rate, substeps)

    @property
    def scenario(self) -> Scenario:
        """The problem as Alight takes it."""
        return problem_scenario(self.duration, self.substeps)

    @property
    def ticks(self) -> int:
        """Number of samples of the law."""
        return round(self.duration * self.sample_rate)

    @property
    def times(self) -> np.ndarray:
        """Times of the rows that a peer returns [s]."""
        return np.arange(0, self.ticks, RECORD_EVERY) / self.sample_rate


def numbers_of(scenario: Scenario) -> Numbers:
    """Copy every number out of a scenario."""
    law, plant, start = scenario.law, scenario.plant, scenario.start
    arm, body, g = plant.arm, plant.body, law.gains
    boxes = {
        name: Box(b.initial, b.lower, b.upper, b.margin, b.leak)
        for name, b in (("theta_dk", law.theta_dk), ("theta_r", law.theta_r))
    }
    gains = ("k1", "k2", "k3", "alpha1", "alpha2", "alpha3", "alpha", "Gamma")
    return Numbers(
        **{name: getattr(arm, name) for name in ("l1", "l2", "p1", "p2", "p3")},
        **{name: getattr(body, name) for name in ("m", "k_s", "x_0")},
        **{name: getattr(g, name) for name in gains},
        **boxes,
        K_I=plant.contact.K_I,
        x_md=scenario.target.x_md,
        x_rd2=scenario.target.x_rd2,
        Gamma_r=law.Gamma_r,
        tau_max=scenario.testbed.motors.limit,
        q0=start.q,
        x_m0=start.x_m,
        e_f0=law.e_f,
    )


def varied(n: Numbers, batch: int) -> Numbers:
    """Return numbers whose ``m`` and ``k_s`` are arrays of ``batch`` runs, the first nominal."""
    factors = np.random.default_rng(0).uniform(0.9, 1.1, (2, batch))
    factors[:, 0] = 1.0
    return replace(n, m=n.m * factors[0], k_s=n.k_s * factors[1])


@dataclass(frozen=True)
class Peer:
    """One way to run the closed loop, written as the users of a tool would write it."""

    name: str
    package: str
    """Distribution that must be installed."""
    how: str
    """One sentence: what is integrated, and with what."""
    prepare: Callable[[Problem], Run]
    """Do what a user does once (import, compile, build the model) and return the run.

    The run integrates the whole duration, or a batch of them, and returns ``[q1, q2, x_m]`` of the
    (first) run at `Problem.times`, shape (n, 3).
    """
    continuous: bool = False
    """Integrates the continuous closed loop instead of the sampled one."""
    batch: int = 1
    """Runs in one call."""
    tolerance: float = 1e-8
    """How far its own integrator or contact may lead it away in the first 0.3 s [rad, m]."""

    @property
    def version(self) -> str | None:
        """Version of the package; None if it is not installed."""
        try:
            return metadata.version(self.package)
        except metadata.PackageNotFoundError:
            return None
