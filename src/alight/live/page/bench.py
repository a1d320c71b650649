"""The live bench as the page sees it: attached to its newest host, commands out, news in."""

from __future__ import annotations

import asyncio
import json
import os
import time
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from alight.errors import AlightError
from alight.live.bank import Bank, parameter_column, with_parameters
from alight.live.page.draft import taking_over
from alight.live.page.health import Health, health_of
from alight.live.page.news import Line, told
from alight.live.page.source import LiveSource
from alight.live.session import Link, Session
from alight.live.shared.commands import Answer, CommandBox, Kind, Outcome
from alight.live.shared.status import State
from alight.simulation.closed_loop import ClosedLoop
from alight.symbolic.parameters import numeric_fields

PATIENCE = 20.0
"""Longest wait for an answer of a host that lives [s]: real drives take their time to start."""
RESTART = "restart-host"
"""File in the folder of the session that asks the supervisor for another host."""
KEPT = 400
"""Lines of the log."""


@dataclass(frozen=True)
class InForce:
    """The law that the host runs, and since which row of telemetry."""

    law: int
    loop: ClosedLoop
    tick: int = 0


class Bench:
    """State of the bench, renewed by `poll` a few times a second; nothing here waits for the host.

    Parameters
    ----------
    session : Session
        The bench.
    """

    def __init__(self, session: Session) -> None:
        self.session = session
        self.scenario = session.scenario
        self.bank = Bank.of(self.scenario)
        self.link: Link | None = None
        self.source: LiveSource | None = None
        self.health: Health | None = None
        self.in_force = InForce(0, self.bank.loops[0])
        self.lines: deque[Line] = deque(maxlen=KEPT)
        self.told = 0
        """Number of lines that were ever logged."""
        self.t = 0.0
        """Time since the start of the run [s]."""
        self.rate = 0.0
        """Ticks per second, as counted."""
        self.recorder: dict[str, Any] = {}
        self._parent = os.getppid()
        self._followed = 0
        self._state: State | None = None
        self._alive: bool | None = None
        self._counted = (0.0, 0)
        self._looked = 0.0

    # What there is

    @property
    def alive(self) -> bool:
        """Whether there is a host that ticks."""
        return self.health is not None and self.health.alive

    @property
    def state(self) -> State | None:
        """What the host does; None if there is none that ticks."""
        return self.health.state if self.health is not None and self.health.alive else None

    @property
    def supervised(self) -> bool:
        """Whether the process that started this one is still there."""
        return os.getppid() == self._parent

    @property
    def restarting(self) -> bool:
        """Whether another host has been asked for and is not there yet."""
        return (self.session.folder / RESTART).exists()

    # News

    def poll(self) -> None:
        """Look what has changed."""
        now = time.monotonic()
        if now - self._looked > 0.4:
            self._looked = now
            self._look()
        if self.link is None:
            return
        self.health = health_of(self.link.status)
        self._follow()
        self._notice(self.health)
        self._measure(now, self.health)

    def log(
        self, kind: str, text: str, by: str = "", t: float | None = None, *, past: bool = False
    ) -> None:
        """Add a line to the log; of what is past the time of day is not known."""
        self.told += 1
        self.lines.append(Line(self.told, 0.0 if past else time.time(), t, kind, text, by))

    def _look(self) -> None:
        """What files say: another host, the recorder."""
        hosts = self.session.hosts
        if hosts and (self.link is None or hosts[-1] != self.link.folder):
            self._attach(hosts[-1])
        try:
            content = json.loads((self.session.folder / "recorder.json").read_bytes())
        except (OSError, ValueError):
            content = {}
        self.recorder = content if isinstance(content, dict) else {}

    def _attach(self, folder: Path) -> None:
        try:
            self.link = Link.open(folder)
        except (AlightError, OSError, ValueError) as error:
            self.log("host", f"{folder.name} cannot be joined: {error}")
            return
        self.source = LiveSource(self.link, self.scenario)
        self.log("host", f"{folder.name} is ready, {len(self.bank.names)} laws")
        self.in_force = _recovered(self.bank, self.link.commands)
        self._followed = max(self.link.commands.done - KEPT // 2, 0)
        self._state, self._alive = None, None
        self._follow(past=True)

    def _follow(self, *, past: bool = False) -> None:
        """Log the commands that were dealt with, whoever asked for them."""
        assert self.link is not None
        box = self.link.commands
        while self._followed < box.done:
            self._followed += 1
            kind, answer = box.kind_of(self._followed), box.answer(self._followed)
            if kind is None:
                continue
            by, text = told(kind, box.text_of(self._followed))
            if answer.outcome is Outcome.REFUSED:
                self.log("refused", f"{text}: {answer.reason}", by, past=past)
            else:
                self.log(kind.name.lower(), text, by, self.time_of(answer.tick), past=past)

    def _notice(self, health: Health) -> None:
        """Log trips, and that the host fell silent or came back."""
        if health.alive != self._alive and self._alive is not None:
            last = f"is silent; its last state was {health.state.name}"
            self.log("host", f"the host {'ticks again' if health.alive else last}")
        self._alive = health.alive
        if health.state is State.TRIPPED and self._state is not State.TRIPPED:
            self.log("trip", health.reason, t=self.t if self._state is not None else None)
        self._state = health.state

    def _measure(self, now: float, health: Health) -> None:
        before, ticks = self._counted
        if not before or health.ticks < ticks:
            self._counted = (now, health.ticks)
        elif now - before >= 1.0:
            self.rate = (health.ticks - ticks) / (now - before)
            self._counted = (now, health.ticks)
        assert self.link is not None
        self.t = self.time_of(self.link.ring.head - 1) or 0.0

    def time_of(self, row: int) -> float | None:
        """Time since the start of the run [s] at a row of telemetry; None if it is not kept."""
        assert self.link is not None
        row = max(min(row, self.link.ring.head - 1), 0)
        first, rows = self.link.ring.read(row, 1)
        if not len(rows) or first != row:
            return None
        return float(rows[0, self.link.layout.slices()["t"]][0])

    # What is asked of the host

    async def submit(
        self, kind: Kind, by: str, *, law: int = 0, values: Any = (), told: Mapping[str, Any] = {}
    ) -> Answer:
        """Ask something of the host, and wait for its answer without holding anybody up.

        Raises
        ------
        AlightError
            If the host does not live, or does not answer.
        """
        link = self.link
        if link is None or not self.alive:
            raise AlightError("the host is not running")
        text = json.dumps({"by": by, "values": {}, **told}, allow_nan=False)
        number = link.commands.submit(kind, law=law, values=values, text=text)
        until = time.monotonic() + PATIENCE
        while link.commands.answer(number).outcome is Outcome.PENDING:
            if time.monotonic() > until or link is not self.link or not self.alive:
                raise AlightError("the host has not answered")
            await asyncio.sleep(0.01)
        return link.commands.answer(number)

    async def apply(self, by: str, number: int, loop: ClosedLoop) -> Answer:
        """Put a law with its parameters in force, between two ticks."""
        before = self.in_force
        same = number == before.law
        known = before.loop if same else taking_over(self.bank, number, before.loop)
        told: dict[str, Any] = {"values": _changed(known, loop)}
        if not same:
            told["law"] = self.bank.names[number]
        answer = await self.submit(
            Kind.PARAMETERS if same else Kind.LAW,
            by,
            law=number,
            values=parameter_column(loop),
            told=told,
        )
        if answer.outcome is Outcome.APPLIED:
            self.in_force = InForce(number, loop, answer.tick)
        return answer

    async def kick(self, by: str, torque: tuple[float, float], duration: float) -> Answer:
        """Push with a torque at either joint [N m] for a duration [s]."""
        values = {"kick": list(torque), "duration": duration}
        return await self.submit(Kind.KICK, by, values=(*torque, duration), told={"values": values})

    def ask_for_host(self, by: str) -> None:
        """Ask the supervisor for another host in place of one that is dead.

        Raises
        ------
        AlightError
            If there is nobody to ask, or the host lives.
        """
        if self.alive:
            raise AlightError("the host is running")
        if not self.supervised:
            raise AlightError("the supervisor is gone; start `alight live` again")
        (self.session.folder / RESTART).touch()
        self.log("host", "another host was asked for", by)


def _changed(before: ClosedLoop, loop: ClosedLoop) -> dict[str, Any]:
    """Values by path in which two laws of one kind differ."""
    old = {path: value for path, value, _ in numeric_fields(before.law, "law.")}
    return {
        path: value for path, value, _ in numeric_fields(loop.law, "law.") if value != old[path]
    }


def _recovered(bank: Bank, box: CommandBox) -> InForce:
    """What is in force at a host that was given commands before: its last set, if it is kept."""
    for number in range(box.done, 0, -1):
        command, answer = box.command(number), box.answer(number)
        if command is None:
            break
        if command.kind in (Kind.PARAMETERS, Kind.LAW) and answer.outcome is Outcome.APPLIED:
            loop = with_parameters(bank.loops[command.law], command.values)
            return InForce(command.law, loop, answer.tick)
    return InForce(0, bank.loops[0])
