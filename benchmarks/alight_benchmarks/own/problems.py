"""The scenarios that Alight itself runs; each is read once, so that all rows have one plant."""

from __future__ import annotations

import dataclasses
from functools import cache
from typing import Any

import numpy as np

from alight import Scenario, load_scenario
from alight_benchmarks.peer import problem_scenario

PLAIN_SUBSTEPS = 4
"""Runge-Kutta steps in a sample of whatever does not locate the switch of contact."""
FULL = "experiment-1"
"""Scenario with sensors, quantisation, noise and friction."""


@cache
def ideal(duration: float = 10.0, substeps: int | None = None) -> Scenario:
    """The problem of the peers with as few steps as Alight takes of itself."""
    return _with(problem_scenario(duration), substeps=substeps)


@cache
def full(duration: float = 10.0, substeps: int | None = None) -> Scenario:
    """The first experiment as it ships."""
    settings = {"duration": duration, "steady_state": min(2.0, duration)}
    return _with(load_scenario(FULL, settings), substeps=substeps)


def _with(scenario: Scenario, **settings: Any) -> Scenario:
    document = dataclasses.replace(scenario.document, **settings)
    return dataclasses.replace(scenario, document=document)


def varied(scenario: Scenario, runs: int, *, seeds: bool) -> dict[str, np.ndarray]:
    """Mass and stiffness of the body within 10 % of the scenario's, the first run nominal."""
    factors = np.random.default_rng(0).uniform(0.9, 1.1, (2, runs))
    factors[:, 0] = 1.0
    body = scenario.plant.body
    values = {"plant.body.m": body.m * factors[0], "plant.body.k_s": body.k_s * factors[1]}
    return {**values, "seed": np.arange(runs)} if seeds else values
