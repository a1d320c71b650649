"""The laws that a bench has ready, so that one can take over from another between two ticks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from alight.control.law import PlainLaw
from alight.errors import AlightError
from alight.scenarios import Scenario
from alight.scenarios.laws import LAWS, make_law, share_settings
from alight.simulation.closed_loop import ClosedLoop
from alight.simulation.law_tick import law_parameters
from alight.symbolic.parameters import values_of


@dataclass(frozen=True)
class Bank:
    """Closed loops that differ in their law alone, by the name of the law; the first one starts.

    All its processes make the same bank of the same scenario, so that a law has one number.
    """

    scenario: Scenario
    names: tuple[str, ...]
    loops: tuple[ClosedLoop, ...]

    @classmethod
    def of(cls, scenario: Scenario) -> Bank:
        """The law of a scenario, and those that ship and can be made of its ``[law]`` table.

        Raises
        ------
        AlightError
            If the law is in ordinary Python, which has no steady time for a tick.
        """
        if isinstance(scenario.law, PlainLaw):
            raise AlightError(
                f"{scenario.name}: law.type = {scenario.document.law['type']!r}: a law in ordinary "
                "Python is too slow for the live bench; write it as an alight.Law, which compiles"
            )
        own = str(scenario.document.law["type"])
        found = {own: scenario.closed_loop}
        for name in LAWS:
            if name in found or not share_settings(own, name):
                continue
            table = {**scenario.document.law, "type": name}
            law = make_law(table, scenario.plant, scenario.target)
            found[name] = scenario.with_law(law).closed_loop
        return cls(scenario, tuple(found), tuple(found.values()))

    @cached_property
    def number_of(self) -> Mapping[str, int]:
        """Number of each law, by its name."""
        return {name: number for number, name in enumerate(self.names)}


def parameter_column(loop: ClosedLoop) -> np.ndarray:
    """Every parameter of a law in the order of its `Controller`: what a command carries."""
    return np.concatenate([values_of(part) for part in law_parameters(loop).values()])


def as_parameters(values: Mapping[str, Any]) -> dict[str, Any]:
    """Parameters by path, as `Controller.update` takes them; of JSON's lists it makes tuples."""
    return {path: tuple(v) if isinstance(v, list) else v for path, v in values.items()}
