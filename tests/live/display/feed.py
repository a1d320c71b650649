"""A bench without a clock: real rows of a real cycle, as many as a test asks for, in real rings."""

from __future__ import annotations

import dataclasses
import json
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

import alight
from alight.live.bank import Bank, parameter_column
from alight.live.cycle import Cycle
from alight.live.devices.simulated import SimulatedTestbed
from alight.live.page.source import LiveSource
from alight.live.session import Link
from alight.live.shared.commands import Command, CommandBox, Kind, Outcome
from alight.live.shared.ring import TelemetryRing
from alight.live.shared.status import create_status

RATE = 2000


@lru_cache
def _bank(name: str) -> Bank:
    return Bank.of(alight.load_scenario(name))


@lru_cache
def _cycle(name: str) -> Cycle:
    """The one cycle of this process: to build it takes a second."""
    bank = _bank(name)
    device = SimulatedTestbed(bank.loops[0], bank.scenario.start, backend="vm")
    return Cycle(bank, device, backend="vm")


def _restart(cycle: Cycle, bank: Bank) -> None:
    """Bring a cycle to where a new one is."""
    cycle.stop()
    cycle.apply(Command(0, Kind.RESET, 0, np.empty(0)))
    cycle.apply(Command(0, Kind.LAW, 0, parameter_column(bank.loops[0])))


class Feed:
    """What a host does at each of its deadlines, done when it is told to."""

    def __init__(self, folder: Path, name: str = "experiment-1", seconds: float = 60.0) -> None:
        self.cycle = _cycle(name)
        self.bank = _bank(name)
        self.scenario = self.bank.scenario
        _restart(self.cycle, self.bank)
        width = self.cycle.layout.size
        folder.mkdir(parents=True, exist_ok=True)
        self.link = Link(
            folder,
            self.cycle.layout,
            TelemetryRing.create(folder / "ring", width, int(seconds * RATE)),
            CommandBox.create(folder / "commands"),
            create_status(folder / "status"),
        )
        self.link.announce()
        self.source = LiveSource(self.link, self.scenario)
        self.missed = 0
        self._rng = np.random.default_rng(5)

    def column(self, name: str) -> np.ndarray:
        """A column of every row that the ring still holds."""
        _, rows = self.ring.read(0)
        return rows[:, self.link.layout.columns.index(name)]

    @property
    def ring(self) -> TelemetryRing:
        return self.link.ring

    def tick(self, count: int = 1, spike: float = 0.0) -> None:
        """So many rows; late and busy are drawn like those of a loaded machine.

        The first of them is late by ``spike`` more.
        """
        late = 2e-5 + 1e-5 * self._rng.gamma(2.0, size=count)
        busy = 3e-5 + 4e-6 * self._rng.gamma(3.0, size=count)
        late[0] += spike
        for i in range(count):
            if self._rng.random() < 2e-4:
                late[i] += 6e-4
                self.missed += 1
            head = self.ring.head
            self.cycle.tick(self.ring.slot, head / RATE, late[i], busy[i], self.missed)
            self.ring.publish()
            self._obey()

    def _obey(self) -> None:
        link = self.link
        while (command := link.commands.take()) is not None:
            reason = self.cycle.apply(command)
            outcome = Outcome.REFUSED if reason else Outcome.APPLIED
            link.commands.reply(command.number, outcome, self.ring.head, reason)
        link.status["state"] = self.cycle.state
        link.status["reason"] = self.cycle.reason.encode()

    def ask(self, kind: Kind, numbers: object = (), law: int = 0, **said: Any) -> int:
        """Submit a command, as the steering page does."""
        text = json.dumps({"by": "test", **said})
        return self.link.commands.submit(kind, law=law, values=numbers, text=text)

    def gains(self, **changes: float) -> int:
        """Ask for other gains, all other parameters as they were."""
        law = self.bank.loops[0].law
        gains = dataclasses.replace(law.gains, **changes)
        other = dataclasses.replace(law, gains=gains)
        column = parameter_column(self.scenario.with_law(other).closed_loop)
        values = {f"law.gains.{name}": value for name, value in changes.items()}
        return self.ask(Kind.PARAMETERS, column, values=values)
