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
from alight.symbolic.parameters import numeric_fields, replaced, values_of


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


class ColumnOf:
    """The parameters of a closed loop's law as a column, and what another column makes of it.

    Where each parameter stands is found once, so that a change costs no more than a tick.

    Attributes
    ----------
    loop : ClosedLoop
        The loop with the parameters of now.
    now : (n,) array
        `parameter_column` of it.
    """

    def __init__(self, loop: ClosedLoop) -> None:
        self.loop, self.now = loop, parameter_column(loop)
        self._places: list[tuple[str, slice, bool]] = []
        first = 0
        for name, part in law_parameters(loop).items():
            for path, value, _ in numeric_fields(part, f"{name}."):
                place = slice(first, first + np.size(value))
                self._places.append((path, place, isinstance(value, tuple)))
                first = place.stop

    def changed(self, column: np.ndarray) -> ClosedLoop:
        """The loop with the parameters of another column, validated as a whole.

        Raises
        ------
        AlightError
            If the column has another length, changes what is the testbed's, or a value is refused.
        """
        if column.shape != self.now.shape or not np.isfinite(column).all():
            raise AlightError(f"a law takes {len(self.now)} finite numbers, not {len(column)}")
        differs = np.flatnonzero(column != self.now).tolist()
        changed: dict[str, Any] = {}
        for path, place, several in self._places if differs else []:
            if any(place.start <= at < place.stop for at in differs):
                given = column[place].tolist()
                changed[path] = tuple(given) if several else given[0]
        if fixed := [path for path in changed if not path.startswith("law.")]:
            raise AlightError(
                f"{', '.join(fixed)}: cannot change while the bench is on; restart it"
            )
        made: ClosedLoop = replaced(self.loop, changed)
        return made

    def take(self, loop: ClosedLoop, column: np.ndarray) -> None:
        """Let a loop that `changed` has made of a column be that of now."""
        self.loop = loop
        self.now[:] = column


def with_parameters(loop: ClosedLoop, column: np.ndarray) -> ClosedLoop:
    """A loop whose law has the parameters of a column, validated as a whole.

    The inverse of `parameter_column`; refuses as `ColumnOf.changed` does.
    """
    return ColumnOf(loop).changed(column)
