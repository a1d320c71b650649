"""A recording that plays: rows by number as the ring of a host has them."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from alight.live.session import scenario_of
from alight.scenarios import Scenario
from alight.simulation.recording import Recording
from alight.simulation.recording_description import TIME
from alight.simulation.recording_events import Event, EventKind
from alight.symbolic.signals import Layout

SPEEDS = (0.01, 100.0)
"""Slowest and fastest play, as multiples of the bench's own time."""


class ReplaySource:
    """Rows of a recording up to a head that moves: forward as it plays, anywhere by `seek`.

    The number of a row is that of its tick since the run began. Rows that were lost, and those
    before the recording began, are passed over by `read`.

    Parameters
    ----------
    recording : Recording or path
        What is played.
    clock : callable
        Gives the time [s].
    """

    mode = "replay"

    def __init__(
        self, recording: Recording | str | Path, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self.recording = (
            recording if isinstance(recording, Recording) else Recording.load(recording)
        )
        """What is played."""
        self.layout = Layout({"t": TIME, **self.recording.layout.signals})
        """What a row holds."""
        self.dt = _sample_time(self.recording)
        """Time between two rows [s]."""
        self._row = _numbers(self.recording.t, self.dt)
        self._clock, self._speed = clock, 1.0
        self._at = float(self.first)
        self._since: float | None = None

    @cached_property
    def scenario(self) -> Scenario:
        """What ran, with the law in force at its start."""
        return scenario_of(dict(self.recording.scenario))

    @property
    def first(self) -> int:
        """Number of the first row."""
        return int(self._row[0]) if len(self._row) else 0

    @property
    def rows(self) -> int:
        """Number after that of the last row."""
        return int(self._row[-1]) + 1 if len(self._row) else 0

    # Playing

    @property
    def head(self) -> int:
        """Number of rows there are up to now."""
        passed = 0.0 if self._since is None else (self._clock() - self._since) * self._speed
        at = self._at + passed / self.dt
        if at >= self.rows:
            self._at, self._since = float(self.rows), None
            return self.rows
        return int(at)

    @property
    def playing(self) -> bool:
        """Whether the head moves."""
        return self.head < self.rows and self._since is not None

    @property
    def speed(self) -> float:
        """How fast it plays, as a multiple of the bench's own time."""
        return self._speed

    @speed.setter
    def speed(self, speed: float) -> None:
        head, playing = self.head, self.playing
        self._at, self._since = float(head), self._clock() if playing else None
        self._speed = float(np.clip(speed, *SPEEDS))

    def play(self) -> None:
        """Let the head move; from the beginning if it stands at the end."""
        if self.head >= self.rows:
            self._at = float(self.first)
        if self._since is None:
            self._since = self._clock()

    def pause(self) -> None:
        """Let the head stand."""
        self._at, self._since = float(self.head), None

    def seek(self, row: int) -> None:
        """Put the head behind a row."""
        playing = self.playing
        self._at = float(np.clip(row, self.first, self.rows))
        self._since = self._clock() if playing else None

    # Reading

    def read(self, first: int, most: int | None = None) -> tuple[int, np.ndarray]:
        """Rows that follow one another, from number ``first`` on, as `TelemetryRing.read`.

        Returns
        -------
        first : int
            Number of the first row returned: later than asked for where rows are missing.
        rows : (n, columns) array
            None from the head on.
        """
        begin, end = np.searchsorted(self._row, [first, self.head])
        if begin >= end:
            return first, np.empty((0, self.layout.size))
        first = int(self._row[begin])
        if most is not None:
            end = min(end, begin + most)
        follow = self._row[begin:end] - np.arange(end - begin) == first
        end = begin + (len(follow) if follow.all() else int(np.argmin(follow)))
        recording = self.recording
        return first, np.column_stack([recording.t[begin:end], recording.samples[begin:end]])

    def events(self, since: int = 0) -> list[Event]:
        """What happened from row ``since`` on, the whole recording's: they are marks to seek by."""
        return [event for event in self.recording.events if event.row >= since]

    def changes_at(self, row: int) -> Mapping[str, Any]:
        """Parameters that had been changed by hand up to a row, by path, and what they were."""
        changed: dict[str, Any] = {}
        for event in self.recording.events:
            if event.row <= row and event.kind in (
                EventKind.GAINS,
                EventKind.TARGET,
                EventKind.LAW,
            ):
                changed |= event.changes
        return changed

    def law_at(self, row: int) -> str:
        """Name of the law that was in force at a row."""
        name = str(self.recording.scenario.get("law", {}).get("type", ""))
        for event in self.recording.events:
            if event.row <= row and event.kind == EventKind.LAW:
                name = event.law
        return name


def _sample_time(recording: Recording) -> float:
    """Time between two samples [s]."""
    if "dt" in recording.bench:
        return float(recording.bench["dt"])
    if len(recording) > 1:
        return float(np.median(np.diff(recording.t)))
    return 1 / float(recording.scenario.get("testbed", {}).get("sample_rate", 2000.0))


def _numbers(t: np.ndarray, dt: float) -> np.ndarray:
    """Number of each row: which multiple of the sample time it stands at."""
    found = np.rint(t / dt).astype(np.int64)
    # Samples that are not evenly spaced, as the last one of a thinned run, are only counted.
    return found if (np.diff(found) > 0).all() else np.arange(len(t))
