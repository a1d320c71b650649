"""Scenario files: plant, testbed, law, start and target with their numbers and sources."""

from alight.scenarios.load import load_scenario, parse_overrides
from alight.scenarios.scenario import Provenance, Scenario, Start
from alight.scenarios.shipped import shipped_scenarios
from alight.scenarios.simulate import simulate
from alight.scenarios.simulate_batch import Batch, simulate_batch

__all__ = [
    "Batch",
    "Provenance",
    "Scenario",
    "Start",
    "load_scenario",
    "parse_overrides",
    "shipped_scenarios",
    "simulate",
    "simulate_batch",
]
