"""One run that is being recorded: its rows, its events, its end."""

from __future__ import annotations

import dataclasses
import re
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from alight.control import Law, Target
from alight.live.bank import Bank, with_parameters
from alight.live.record.happenings import Happenings
from alight.live.record.place import InForce, RunPlace
from alight.live.record.run_file import RunFile
from alight.live.replay.ending import reason_of, verdict_of
from alight.live.session import Link, Settings
from alight.live.shared.status import State
from alight.scenarios.scenario import settings_of
from alight.simulation.mcap_parts import CONTINUES, next_part
from alight.simulation.recording_description import Description
from alight.simulation.recording_events import Event, EventKind
from alight.simulation.verdict import Outcome, Verdict
from alight.symbolic.signals import Layout

LINGER = 2.0
"""How long [s] a recording goes on after the motors went without torque."""
SOON = 0.02
"""Within this time [s] after the row of a trip the host says why."""


class Run:
    """A run from its first row on, which `take` finds over when it is.

    Parameters
    ----------
    settings, link, bank
        The bench and its host.
    place : RunPlace
        Where the run began, and its file.
    row : int
        Row of the ring with which this file begins.
    command : int
        Number of the last command dealt with before that row.
    follows : bool
        Whether the file of ``place`` is there already: the run goes on in another.
    """

    def __init__(
        self,
        settings: Settings,
        link: Link,
        bank: Bank,
        place: RunPlace,
        row: int,
        command: int,
        follows: bool = False,
    ) -> None:
        self._settings, self._link, self._bank = settings, link, bank
        self._happenings = Happenings(link, bank)
        slices = link.layout.slices()
        self._at = {name: slices[name].start for name in ("state", "trip", "law", "command")}
        self._linger = round(LINGER / bank.loops[0].dt)
        self.place, self._command, self.over = place, command, False
        self._begins = row - place.first
        self._last = self._row_before(row, place)
        self._state = State(int(self._last[self._at["state"]]))
        self._pending: list[Event] = []
        path = Path(place.file)
        self._description = self._describe(path.name if follows else "")
        self._file = RunFile(next_part(path) if follows else path, self._description)
        self.place = dataclasses.replace(place, file=str(self._file.path))

    def _row_before(self, row: int, place: RunPlace) -> np.ndarray:
        """What came before the first row, as far as the ring still holds it."""
        at, rows = self._link.ring.read(row - 1, 1)
        if self._begins > 0 and len(rows) and at == row - 1:
            return rows[0]
        made = np.full(self._link.layout.size, np.nan)
        made[0] = max(self._begins - 1, 0) * self._bank.loops[0].dt
        made[self._at["state"]] = State.RUNNING if place.ended is None else State.STOPPED
        made[self._at["trip"]] = made[self._at["law"]] = 0.0
        return made

    @property
    def bytes(self) -> int:
        """Size of this file on the disk."""
        return self._file.saved_bytes

    @property
    def running(self) -> bool:
        """Whether the motors had torque in its last row."""
        return self._last[self._at["state"]] == State.RUNNING

    def take(self, first: int, rows: np.ndarray) -> int:
        """Record rows that follow one another, up to the end of the run.

        Parameters
        ----------
        first : int
            Number of their first in the ring.
        rows : (n, columns) array
            At least one.

        Returns
        -------
        int
            How many of them belong to the run.
        """
        count = self._count(first, rows[:, self._at["state"]])
        if count:
            own = rows[:count]
            events = [*self._pending, *self._events(first, own)]
            self._file.write(own, first - self.place.first, events)
            self._pending = []
            self._last, self._command = own[-1].copy(), int(own[-1, self._at["command"]])
        return count

    def _count(self, first: int, state: np.ndarray) -> int:
        """How many rows belong to the run; finds it over, and when the torque went."""
        again = np.flatnonzero(state == State.READY)
        count = int(again[0]) if len(again) else len(state)
        self.over = bool(len(again))
        if self.place.ended is None:
            without = np.flatnonzero(state[:count] != State.RUNNING)
            if len(without):
                self.place = dataclasses.replace(self.place, ended=first + int(without[0]))
        if self.place.ended is not None:
            left = max(self.place.ended + self._linger - first, 0)
            if left < count:
                count, self.over = left, True
        return count

    def _events(self, first: int, rows: np.ndarray) -> Iterator[Event]:
        state, command = rows[:, self._at["state"]], rows[:, self._at["command"]]
        earlier = np.concatenate([[self._state], state[:-1]])
        trips = (state == State.TRIPPED) & (earlier != State.TRIPPED)
        stops = (state == State.STOPPED) & (earlier != State.STOPPED)
        known = np.concatenate([[self._command], command[:-1]])
        for i in np.flatnonzero((command > known) | trips | stops):
            row, t = first + int(i) - self.place.first, float(rows[i, 0])
            numbers = range(int(known[i]) + 1, int(command[i]) + 1)
            told = list(self._happenings.events(numbers, row, t))
            yield from told
            if stops[i] and not any(event.kind == EventKind.STOP for event in told):
                yield Event(row, t, EventKind.STOP, "stopped: the host was told to end")
            if trips[i]:
                code = int(rows[i, self._at["trip"]])
                reason = self._reason(code, int(rows[i, self._at["law"]]))
                yield Event(row, t, EventKind.TRIP, reason, values=(float(code),))
        self._state = State(int(state[-1]))

    def _reason(self, code: int, law: int) -> str:
        status = self._link.status
        if int(status["trip"]) != code:
            time.sleep(SOON)
        said = status["reason"].decode(errors="replace") if int(status["trip"]) == code else ""
        return said or reason_of(code, self._bank, law)

    def lose(self, first: int, last: int) -> None:
        """Note that rows had left the ring before they could be recorded."""
        count, row = last - first, first - self.place.first
        text = f"{count} rows were lost: the recorder was not there, or had no place to write"
        t = row * self._bank.loops[0].dt
        self._pending.append(Event(row, t, EventKind.ROWS_LOST, text, values=(float(count),)))

    def goes_on_with(self, row: int, values: np.ndarray) -> bool:
        """Whether a row of the ring is of this run, and not of one that began meanwhile."""
        t = (row - self.place.first) * self._bank.loops[0].dt
        return abs(values[0] - t) < self._bank.loops[0].dt / 2

    def save(self) -> None:
        """Force everything to the disk; raises `OSError`."""
        self._file.save()

    def finish(self, host_lost: bool = False) -> None:
        """Close the file with how the run ended; raises `OSError`."""
        last, dt = self._last, self._bank.loops[0].dt
        lost = any(event.kind == EventKind.ROWS_LOST for event in self._pending)
        died = host_lost and self.running
        if died:
            t = float(last[0]) + dt
            text = "the host died in mid-run"
            self._pending.append(Event(round(t / dt), t, EventKind.HOST_LOST, text))
        end = last[0] if self.place.ended is None else (self.place.ended - self.place.first) * dt
        state, code, law = (int(last[self._at[name]]) for name in ("state", "trip", "law"))
        reason = self._reason(code, law)
        verdict = verdict_of(State(state), code, reason, float(end), self._bank, law)
        if self.running and (died or lost):
            cause = "the host died" if died else "its end was lost"
            verdict = Verdict(Outcome.CUT_OFF, float(end), None, cause)
        self._file.write(np.empty((0, len(last))), 0, self._pending)
        self._file.finish(
            dataclasses.replace(self._description, samples=self._file.rows, verdict=verdict)
        )

    def abandon(self) -> None:
        """Close the file without an end, and remove it if it has no rows."""
        self._file.abandon()

    def leave(self) -> None:
        """Close the file without an end: another recorder goes on with it."""
        self._file.leave()

    def _describe(self, before: str) -> Description:
        """What is known when the file begins, which goes on where the one ``before`` ended."""
        settings, start = self._settings, self.place.start
        loop = with_parameters(self._bank.loops[start.law], np.array(start.parameters))
        name = self._bank.names[start.law]
        bench = {
            "begun": time.strftime("%Y-%m-%dT%H:%M:%S%z"),
            "laws": list(self._bank.names),
            "law": name,
            "parameters": list(start.parameters),
            "certain": start.certain,
            "command": start.command + 1,
            "device": settings.device,
            "dt": loop.dt,
            "host": self._link.folder.name,
            "first": self.place.first,
            "row": self._begins,
            "opened": settings.scenario,
        }
        if before:
            bench[CONTINUES] = {"file": before, "row": self._begins}
        signals = dict(self._link.layout.signals)
        signals.pop("t")
        verdict = Verdict(Outcome.CUT_OFF, 0.0, None, "it is being recorded")
        return Description(None, Layout(signals), verdict, self._scenario(name, loop.law), bench)

    def _scenario(self, name: str, law: Law) -> dict[str, Any]:
        """The scenario with the law that was in force when the run began."""
        opened = self._settings.scenario
        made = {
            **opened,
            "law": {"type": name, **settings_of(law)},
            "seed": self._settings.seed,
        }
        if isinstance(target := getattr(law, "target", None), Target):
            made["target"] = dataclasses.asdict(target)
        # Whoever changed a number by hand is its source.
        sources = opened.get("provenance", {})
        kept = {p: source for p, source in sources.items() if _at(made, p) == _at(opened, p)}
        return {**made, "provenance": kept}


def _at(data: Any, path: str) -> Any:
    """The value at a path of nested tables, in the shape that JSON gives it."""
    for name in path.split("."):
        data = data.get(name) if isinstance(data, dict) else None
    return list(data) if isinstance(data, tuple) else data


def file_name(scenario: str) -> str:
    """Name of the file of a run that begins now."""
    name = re.sub(r"[^\w.-]+", "-", scenario) or "run"
    return f"{name}-{time.strftime('%Y%m%d-%H%M%S')}.mcap"


def place_of(settings: Settings, row: int, t: float, start: InForce, dt: float) -> RunPlace:
    """Where a run began, of which a row with time ``t`` is at hand."""
    path = Path(settings.recordings) / file_name(str(settings.scenario["name"]))
    return RunPlace(str(path.resolve()), row - round(t / dt), start)
