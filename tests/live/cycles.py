"""A `Cycle` on a simulated testbed, driven tick by tick within the process of a test."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

import alight
from alight.live.bank import Bank, parameter_column
from alight.live.cycle import Cycle
from alight.live.devices.simulated import SimulatedTestbed
from alight.live.shared.commands import Command, Kind
from alight.scenarios import Scenario
from alight.symbolic.parameters import replaced

SHORT = ("duration=0.5", "steady_state=0.1")


@functools.cache
def scenario(name: str = "experiment-1", *settings: str) -> Scenario:
    return alight.load_scenario(name, [*SHORT, *settings])


class Driven:
    """A cycle, its rows so far, and the numbering of its commands."""

    def __init__(self, chosen: Scenario, backend: Any = "vm") -> None:
        self.scenario, self.bank = chosen, Bank.of(chosen)
        device = SimulatedTestbed(chosen.closed_loop, chosen.start, chosen.document.seed, backend)
        self.cycle = Cycle(self.bank, device, backend)
        self.begin()

    def begin(self) -> None:
        """Stand where a new one stands."""
        self.number, self.kept = 0, []
        self.command(Kind.STOP)
        self.command(Kind.RESET)
        self.command(Kind.LAW, 0, parameter_column(self.bank.loops[0]))
        self.number = 0

    def command(self, kind: Kind, law: int = 0, values: object = ()) -> str:
        """Apply a command; why it was refused."""
        self.number += 1
        given = np.asarray(values, dtype=float)
        return self.cycle.apply(Command(self.number, kind, law, given))

    def ticks(self, count: int) -> np.ndarray:
        """The rows of some ticks."""
        rows = np.empty((count, self.cycle.layout.size))
        for row in rows:
            self.cycle.tick(row)
        self.kept.extend(rows)
        return rows

    @property
    def rows(self) -> np.ndarray:
        return np.array(self.kept)

    def __getitem__(self, name: str) -> np.ndarray:
        """A signal in all rows so far."""
        return self.of(self.rows, name)

    def of(self, rows: np.ndarray, name: str) -> np.ndarray:
        """A signal in some rows."""
        found = rows[:, self.cycle.layout.slices()[name]]
        return found[:, 0] if found.shape[1] == 1 else found

    def changed(self, law: int = 0, **values: Any) -> np.ndarray:
        """Parameters of a law with some changed: ``gains__k1=2.0``."""
        loop = self.bank.loops[law]
        paths = {f"law.{name.replace('__', '.')}": value for name, value in values.items()}
        return parameter_column(replaced(loop, paths))


@functools.cache
def built(name: str = "experiment-1", *settings: str) -> Driven:
    return Driven(scenario(name, *settings))


def driven(name: str = "experiment-1", *settings: str) -> Driven:
    """A cycle as if it were new: building one takes a second."""
    made = built(name, *settings)
    made.begin()
    return made
