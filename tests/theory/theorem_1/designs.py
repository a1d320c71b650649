"""Random designs, made of numbers alone."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np

import alight
from alight.control import Estimate, Gains
from alight.scenarios.assumptions import Assumptions
from alight.theory.case import Case, case_of
from alight.theory.inertia import InertiaBounds
from alight.theory.theorem_1 import Design

SPECIMEN = Path(__file__).parents[3] / "examples" / "feasible-design.toml"


def case(name: str | Path, values: dict | None = None) -> Case:
    return case_of(alight.load_scenario(name, values or {}))


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def random_pair(rng: np.random.Generator, low: float, high: float) -> tuple[float, float]:
    return log_uniform(rng, low, high), log_uniform(rng, low, high)


def random_design(rng: np.random.Generator) -> Design:
    """Slow gains, soft contacts and light arms, for which the conditions often have values."""
    stiffness, mass = log_uniform(rng, 1e-4, 1.0), log_uniform(rng, 0.1, 1e3)
    gains = Gains(
        k1=log_uniform(rng, 1e-3, 1e3),
        k2=log_uniform(rng, 1.0, 1e6),
        k3=random_pair(rng, 1.0, 1e4),
        alpha1=log_uniform(rng, 1e-5, 1.0),
        alpha2=log_uniform(rng, 1e-3, 10.0),
        alpha3=log_uniform(rng, 1e-5, 1.0),
        alpha=random_pair(rng, 0.01, 100.0),
        Gamma=log_uniform(rng, 0.1, 10.0),
    )
    spread = 1 + rng.uniform(0.01, 0.5)
    spring = (stiffness / spread, stiffness * spread)
    return Design(
        gains=gains,
        bounds=Assumptions(
            mass / spread, mass * spread, spring, spring, float(rng.uniform(-0.8, 0.1)), 0.25, 0.05
        ),
        inertia=InertiaBounds(log_uniform(rng, 0.1, 10.0), log_uniform(rng, 10.0, 1e3)),
        x_md=0.236,
        x_0=0.206,
        theta_dk=Estimate(1.0, 0.9, 1.1),
        theta_r=Estimate((1.0, 2.0), (0.9, 1.8), (1.1, 2.2)),
        Gamma_r=random_pair(rng, 1e-3, 10.0),
        z_bar=log_uniform(rng, 0.01, 10.0),
        V_0=log_uniform(rng, 0.01, 1e3),
    )


def with_gains(design: Design, **gains: float | tuple[float, float]) -> Design:
    return dataclasses.replace(design, gains=dataclasses.replace(design.gains, **gains))
