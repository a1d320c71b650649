"""A recorded run of a simulated bench, reproduced without a clock from what was done to it."""

from __future__ import annotations

import dataclasses
from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from alight.errors import AlightError
from alight.kernels.select import Backend
from alight.live.bank import Bank
from alight.live.cycle import DEADLINES, Cycle
from alight.live.devices.simulated import SimulatedTestbed
from alight.live.replay.ending import verdict_of
from alight.live.session import scenario_of
from alight.live.shared.commands import Command, Kind
from alight.live.shared.status import State
from alight.simulation.recording import Recording
from alight.simulation.recording_events import Event, EventKind

TIMEKEEPING = ("wall", "late", "busy", "missed")
"""Signals that tell of the clock, not of the run."""
BLOCK = 2048
"""Ticks between two reports of progress."""

_KINDS: dict[str, Kind] = {
    EventKind.START: Kind.START,
    EventKind.STOP: Kind.STOP,
    EventKind.KICK: Kind.KICK,
    EventKind.GAINS: Kind.PARAMETERS,
    EventKind.TARGET: Kind.PARAMETERS,
    EventKind.LAW: Kind.LAW,
}


class NotReproducible(AlightError):
    """A recording that no simulation can repeat; says why."""


@dataclass(frozen=True)
class Difference:
    """The first place at which two recordings differ."""

    row: int
    t: float
    column: str
    recorded: float
    computed: float

    def __str__(self) -> str:
        return (
            f"at {self.t:.6g} s (row {self.row}) {self.column} was {self.recorded!r}, "
            f"and is {self.computed!r}"
        )


def resimulate(
    recording: Recording,
    *,
    backend: Backend = "auto",
    progress: Callable[[float], None] | None = None,
) -> Recording:
    """Repeat a run of the live bench in simulation: start, changes by hand, kicks, stop.

    Parameters
    ----------
    recording : Recording
        A run of the simulated testbed, from its first row on.
    backend : {"auto", "vm", "c"}
        See `alight.kernels.stepper.Stepper`; both give the same bits.
    progress : callable, optional
        Called now and then with the share that is done.

    Returns
    -------
    Recording
        Equal to the bit in every signal but those of `TIMEKEEPING`, which are zero.

    Raises
    ------
    NotReproducible
        If it was made with real drives or not by the live bench, or rows or commands are missing.
    """
    _refuse(recording)
    bench = recording.bench
    bank = Bank.of(scenario_of(dict(bench["opened"])))
    loop, start = bank.scenario.closed_loop, bank.scenario.start
    device = SimulatedTestbed(loop, start, int(recording.scenario["seed"]), backend)
    cycle = Cycle(bank, device, backend)
    if cycle.layout.columns != ("t", *recording.columns):
        raise NotReproducible("the recording has other signals than this version of Alight")
    law = bank.number_of[bench["law"]]
    before = int(bench["command"]) - 1
    _apply(cycle, Command(before, Kind.LAW, law, np.array(bench["parameters"])))
    rows = _run(cycle, bank, recording, progress)
    last = rows[-1] if len(rows) else np.zeros(cycle.layout.size)
    at = {name: cycle.layout.slices()[name].start for name in ("state", "trip", "law")}
    state = State(int(last[at["state"]]))
    verdict = verdict_of(
        state, cycle.code, cycle.reason, recording.verdict.time, bank, int(last[at["law"]])
    )
    if state is State.RUNNING:
        verdict = recording.verdict
    return dataclasses.replace(recording, t=rows[:, 0].copy(), samples=rows[:, 1:], verdict=verdict)


def _run(
    cycle: Cycle, bank: Bank, recording: Recording, progress: Callable[[float], None] | None
) -> np.ndarray:
    """Every row of a run, each event before the tick that first showed it."""
    events: dict[int, list[Event]] = defaultdict(list)
    for event in recording.events:
        events[event.row].append(event)
    rows = np.empty((len(recording), cycle.layout.size))
    for i, row in enumerate(rows):
        for event in sorted(events.get(i, ()), key=_turn):
            _happen(cycle, bank, event)
        cycle.tick(row)
        if progress is not None and i % BLOCK == 0:
            progress(i / len(rows))
    return rows


def _turn(event: Event) -> tuple[bool, int]:
    """The order in which the host does what one row is the first to show.

    It trips, deals with commands, and stops last when it was told to end.
    """
    told_to_end = event.kind == EventKind.STOP and not event.number
    return told_to_end, event.number


def _happen(cycle: Cycle, bank: Bank, event: Event) -> None:
    """Do to a cycle what an event did to the bench."""
    if event.kind == EventKind.TRIP:
        # The host alone knows of deadlines; every other trip comes about by itself.
        if event.values[:1] == (DEADLINES,):
            cycle.trip(DEADLINES, event.text)
    elif event.kind == EventKind.STOP and not event.number:
        cycle.stop()
    elif event.kind in _KINDS:
        law = bank.number_of[event.law] if event.law else 0
        values = np.array(event.values, dtype=float)
        _apply(cycle, Command(event.number, _KINDS[event.kind], law, values))
    elif event.number:
        cycle.command = event.number  # it was refused


def _apply(cycle: Cycle, command: Command) -> None:
    if reason := cycle.apply(command):
        raise NotReproducible(f"command {command.number} was applied, and is refused now: {reason}")


def _refuse(recording: Recording) -> None:
    """Refuse what cannot be repeated."""
    bench = recording.bench
    if not bench:
        raise NotReproducible("the recording was not made by the live bench; simulate its scenario")
    if bench.get("device") is not None:
        raise NotReproducible("the recording was made with real drives; no simulation repeats them")
    if not len(recording):
        raise NotReproducible("the recording has no samples")
    if not bench.get("certain", True):
        raise NotReproducible("the recorder did not see every command before the run began")
    missing = [e for e in recording.events if e.kind == EventKind.RECORDER]
    if missing:
        raise NotReproducible(missing[0].text)
    row = np.rint(recording.t / float(bench["dt"]))
    if row[0]:
        before: Any = bench.get("continues", {}).get("file", "a file that is not there")
        raise NotReproducible(f"the beginning of the run is missing; it stands in {before}")
    if (np.diff(row) != 1).any():
        at = int(np.argmax(np.diff(row) != 1))
        raise NotReproducible(f"rows are missing after {recording.t[at]:.6g} s")


def first_difference(recorded: Recording, computed: Recording) -> Difference | None:
    """The first place at which a recording and its simulation differ; None if nowhere.

    Signals of `TIMEKEEPING` are not compared; otherwise every bit counts, but that one NaN is as
    good as another.
    """
    compared = [i for i, name in enumerate(recorded.columns) if name not in TIMEKEEPING]
    for first in range(0, len(recorded), BLOCK):
        block = slice(first, first + BLOCK)
        ours, theirs = (
            np.column_stack([r.t[block], r.samples[block][:, compared]])
            for r in (recorded, computed)
        )
        differs = ours.view(np.uint64) != theirs.view(np.uint64)
        differs &= ~(np.isnan(ours) & np.isnan(theirs))
        if differs.any():
            row, column = np.argwhere(differs)[0]
            names = ["t", *(recorded.columns[i] for i in compared)]
            values = float(ours[row, column]), float(theirs[row, column])
            i = first + int(row)
            return Difference(i, float(recorded.t[i]), names[column], *values)
    return None
