"""Following the rows of one host, and keeping each run in a file."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from alight.files import FileError
from alight.live.bank import Bank
from alight.live.record.happenings import Happenings
from alight.live.record.place import Place, Report, RunPlace
from alight.live.record.run import Run, place_of
from alight.live.session import Link, Session
from alight.live.shared.status import State

BATCH = 2048
"""Rows that are taken at once."""
SAVE = 0.25
"""Time [s] between two points at which everything is safe on the disk."""
AGAIN = 1.0
"""Time [s] between two attempts to write where it failed."""
POLL = 0.05


class Recorder:
    """Takes the rows of a host, one after the other, and loses none that the ring holds.

    Parameters
    ----------
    session : Session
        The bench.
    link : Link
        The host that is followed.
    bank : Bank
        The laws of the bench.
    place : Place, optional
        Where a recorder before this one stood.
    """

    def __init__(
        self, session: Session, link: Link, bank: Bank, place: Place | None = None
    ) -> None:
        self._session, self._link, self._bank = session, link, bank
        self._happenings = Happenings(link, bank)
        slices = link.layout.slices()
        self._state, self._command = slices["state"].start, slices["command"].start
        self._dt = bank.loops[0].dt
        self._safe = place or Place(link.folder.name, 0, self._happenings.opening)
        self._problem = ""
        self._saved = self._tried = -np.inf
        self._run: Run | None = None
        self._row, self._in_force, self._lost = 0, self._safe.in_force, 0
        self._resume: RunPlace | None = None
        self._rewind()
        self._report()

    def follow(self, wanted: Callable[[], bool], alive: Callable[[], bool]) -> None:
        """Record until the host is gone, or this is no longer wanted.

        A run that still goes on when this is no longer wanted is left as a kill would leave it:
        another recorder can go on with it.
        """
        while True:
            # Asked before the last rows are taken: no row comes after it.
            gone, unwanted = not alive(), not wanted()
            while self.step():
                pass
            if (unwanted or (gone and not self._problem)) and self._end(gone, unwanted):
                return
            time.sleep(POLL)

    def step(self) -> bool:
        """Take what is new, at most a batch; whether there may be more at once."""
        if self._problem and time.monotonic() < self._tried + AGAIN:
            return False
        try:
            if self._resume is not None:
                self._continue(self._resume)
            first, rows = self._link.ring.read(self._row, BATCH)
            if len(rows):
                self._take(first, rows)
            if time.monotonic() > self._saved + SAVE:
                self.save()
        except OSError as error:
            self._fail(error)
            return False
        return len(rows) == BATCH

    def _take(self, first: int, rows: np.ndarray) -> None:
        """Take rows that follow one another, from number ``first`` of the ring on."""
        if first > self._row and self._run is not None:
            self._run.lose(self._row, first)
            self._lost += first - self._row
            if not self._run.goes_on_with(first, rows[0]):
                self._close(first)
        at = 0
        while at < len(rows):
            if self._run is None:
                begins = np.flatnonzero(rows[at:, self._state] == State.RUNNING)
                if not len(begins):
                    at = len(rows)
                    break
                at += int(begins[0])
                self._begin(first + at, rows[at])
            if self._run is not None:
                at += self._run.take(first + at, rows[at:])
                self._digest(rows[at - 1] if at else rows[0])
                if self._run.over:
                    self._close(first + at)
        self._digest(rows[-1])
        self._row = first + len(rows)

    def _digest(self, row: np.ndarray) -> None:
        self._in_force = self._happenings.after(self._in_force, int(row[self._command]))

    def _begin(self, row: int, values: np.ndarray) -> None:
        """Begin the recording of the run that a row is of, hopefully its first."""
        command = int(values[self._command])
        start = self._happenings.start_before(command) or command
        before = self._happenings.after(self._in_force, start - 1)
        place = place_of(self._session.settings, row, float(values[0]), before, self._dt)
        self._run = Run(self._session.settings, self._link, self._bank, place, row, start - 1)
        self._row, self._in_force = row, before
        if row > place.first:
            self._run.lose(place.first, row)
            self._lost += row - place.first
        # A recorder after this one finds the file from now on.
        self._safe = self._place()
        self._report()

    def _continue(self, place: RunPlace) -> None:
        """Go on with a run that another recorder, or a disk without room, left unfinished."""
        if Path(place.file).exists():
            ring = self._link.ring
            row = max(self._row, ring.head - ring.capacity + 1)
            command = self._in_force.command
            settings = self._session.settings
            self._run = Run(settings, self._link, self._bank, place, row, command, follows=True)
        else:  # somebody took the file away: what the ring still holds makes a new one
            self._row, self._in_force = place.first, place.start
        self._resume = None

    def _close(self, row: int, host_lost: bool = False) -> None:
        """Finish the file of a run that is over at a row."""
        if self._run is not None:
            self._run.finish(host_lost)
        self._run, self._row = None, row
        self._settle()

    def save(self) -> None:
        """Force everything that was taken to the disk, and say so.

        Raises
        ------
        OSError
            If that does not work; what was taken since the last time is then to be taken again.
        """
        if self._run is not None:
            self._run.save()
        self._settle()

    def _settle(self) -> None:
        self._safe, self._problem, self._saved = self._place(), "", time.monotonic()
        self._report()

    def _place(self) -> Place:
        run = None if self._run is None else self._run.place
        return Place(self._link.folder.name, self._row, self._in_force, run, self._lost)

    def _fail(self, error: OSError) -> None:
        """Say what does not work, and go back to where everything was safe."""
        if self._run is not None:
            self._run.abandon()
        where = error.filename or self._session.settings.recordings
        self._problem = f"{where}: cannot be written: {error.strerror or error}"
        self._tried = time.monotonic()
        self._rewind()
        self._report()

    def _rewind(self) -> None:
        place = self._safe
        self._row, self._in_force, self._lost = place.row, place.in_force, place.lost
        self._run, self._resume = None, place.run

    def _end(self, gone: bool, unwanted: bool) -> bool:
        """Bring the recording to its end; whether that is done."""
        try:
            if self._run is not None and (gone or not self._run.running):
                self._close(self._row, host_lost=gone)
            else:
                self.save()
                self.leave()
        except OSError as error:
            self._fail(error)
            return unwanted
        return True

    def leave(self) -> None:
        """Let go of a run in its midst: another recorder can go on with it."""
        if self._run is not None:
            self._run.leave()
        self._run = None

    def _report(self) -> None:
        """Tell the page; a report that cannot be written now is replaced by the next."""
        run = self._run
        state = "failed" if self._problem else "idle" if run is None else "recording"
        rows = 0 if run is None else self._row - run.place.first
        report = Report(
            state=state,
            file=None if run is None else run.place.file,
            rows=rows,
            seconds=rows * self._dt,
            bytes=0 if run is None else run.bytes,
            lost=self._lost,
            problem=self._problem,
            place=self._safe,
        )
        with contextlib.suppress(FileError):
            report.write(self._session.folder)
