"""A host without a clock and its recorder within one process: rows when a test asks for them."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np

from alight import Recording
from alight.live.bank import Bank, parameter_column
from alight.live.record.place import read_place, read_report
from alight.live.record.recorder import Recorder
from alight.live.session import Link, Session, Settings
from alight.live.shared.commands import Command, CommandBox, Kind, Outcome
from alight.live.shared.ring import TelemetryRing
from alight.live.shared.status import create_status
from tests.live.cycles import Driven, driven

CAPACITY = 6000


class Desk:
    """A cycle whose rows go to a ring, one host of a session, and recorders that follow it."""

    def __init__(self, folder: Path, made: Driven | None = None, capacity: int = CAPACITY) -> None:
        self.made = made or driven()
        self.made.begin()
        self.made.cycle.command = 0
        self.cycle, self.bank = self.made.cycle, self.made.bank
        scenario = self.made.scenario
        self.recordings = folder / "recordings"
        self.settings = Settings(
            scenario.description(), str(self.recordings), seed=scenario.document.seed
        )
        self.session = Session(folder / "session", self.settings)
        self.session.folder.mkdir(parents=True)
        self.recorder: Recorder | None = None
        self.host(capacity)
        self.recorder = self.another()

    def host(self, capacity: int = CAPACITY) -> None:
        """Begin as another host does: with a ring and a box of its own."""
        home, width = self.session.next_host(), self.cycle.layout.size
        self.link = Link(
            home,
            self.cycle.layout,
            TelemetryRing.create(home / "ring", width, capacity),
            CommandBox.create(home / "commands"),
            create_status(home / "status"),
        )
        self.link.announce()
        self.rows: list[np.ndarray] = []

    def another(self) -> Recorder:
        """A recorder that takes over where the one before was last safe, which is killed."""
        self.close()
        place = read_place(self.session.folder)
        here = place if place is not None and place.host == self.link.folder.name else None
        return Recorder(self.session, self.link, Bank.of(self.made.scenario), here)

    def close(self) -> None:
        """Kill the recorder: nothing comes after what it wrote."""
        if self.recorder is not None:
            self.recorder.leave()

    # The host

    def tick(self, count: int) -> None:
        """Rows, into the ring; the status as the host has it."""
        for _ in range(count):
            self.cycle.tick(self.link.ring.slot, wall=1.0, late=2.0, busy=3.0, missed=4.0)
            self.rows.append(self.link.ring.slot.copy())
            self.link.ring.publish()
            self._show()

    def ask(self, kind: Kind, law: int = 0, values: object = (), **changes: float) -> str:
        """A command, as page and host deal with it; why it was refused."""
        box, text = self.link.commands, json.dumps({"by": "test", "values": changes})
        number = box.submit(kind, law=law, values=values, text=text)
        taken = box.take()
        assert isinstance(taken, Command)
        reason = self.cycle.apply(taken)
        outcome = Outcome.REFUSED if reason else Outcome.APPLIED
        box.reply(number, outcome, self.link.ring.head, reason)
        self.cycle.command = box.done
        self._show()
        return reason

    def gains(self, **values: Any) -> str:
        """Other gains for the law in force."""
        loop = self.bank.loops[self.cycle.law]
        law = dataclasses.replace(loop.law, gains=dataclasses.replace(loop.law.gains, **values))
        column = parameter_column(dataclasses.replace(loop, law=law))
        changes = {f"law.gains.{name}": value for name, value in values.items()}
        return self.ask(Kind.PARAMETERS, self.cycle.law, column, **changes)

    def _show(self) -> None:
        status = self.link.status
        status["state"], status["trip"] = self.cycle.state, self.cycle.code
        status["reason"] = self.cycle.reason.encode()

    # The recorder

    def record(self) -> None:
        """Take everything that is new, and see it safe on the disk."""
        while self.recorder.step():
            pass
        self.recorder._saved = -np.inf
        self.recorder.step()

    def end(self, alive: bool = True) -> None:
        """Take everything that is new and end as the process does."""
        self.recorder.follow(lambda: not alive, lambda: alive)

    @property
    def report(self) -> dict[str, Any]:
        found = read_report(self.session.folder)
        assert found is not None
        return found

    @property
    def files(self) -> list[Path]:
        return sorted(self.recordings.glob("*"))

    def load(self) -> Recording:
        """The only recording; its first part."""
        (path,) = (path for path in self.files if ".part" not in path.name)
        return Recording.load(path)

    def assert_holds(self, recording: Recording, first: int, last: int) -> None:
        """A recording has exactly the rows of the ring from one number to another."""
        rows = np.array(self.rows[first:last])
        assert recording.columns == self.link.layout.columns[1:]
        assert len(recording) == len(rows)
        assert recording.t.tobytes() == rows[:, 0].tobytes()
        assert recording.samples.tobytes() == np.ascontiguousarray(rows[:, 1:]).tobytes()


def run(desk: Desk, count: int = 300) -> int:
    """Some rows, a start, more rows; number of the first of the run."""
    desk.tick(20)
    first = len(desk.rows)
    assert desk.ask(Kind.START) == ""
    desk.tick(count)
    return first


def kinds(recording: Recording) -> list[str]:
    return [str(event.kind) for event in recording.events]
