"""The loop of the host: a tick at each deadline, and between two of them a command."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from typing import Any

from alight.live.cycle import DEADLINES, Cycle
from alight.live.host.clock import Budget, Clock, Keeping
from alight.live.session import Link, Settings
from alight.live.shared.commands import Command, Kind, Outcome
from alight.live.shared.status import TEXT, State

SLOW = (Kind.START, Kind.STOP, Kind.RESET)
"""Commands that talk with the device between two ticks: their time is no missed deadline."""
LOOK = 1.0
"""Time [s] between two looks at whether anybody is left."""


class Loop:
    """Runs a `Cycle` against the clock; shares what it does and takes what is asked of it.

    Parameters
    ----------
    cycle : Cycle
        What is driven.
    link : Link
        Ring, commands and status, made by this process.
    settings : Settings
        Give the budget of missed deadlines.
    period : float
        Sample time [s].
    spin : float
        See `Clock`.
    """

    def __init__(
        self, cycle: Cycle, link: Link, settings: Settings, period: float, spin: float = 0.0
    ) -> None:
        self._cycle, self._link = cycle, link
        self._status: Any = link.status
        self._clock = Clock(period, spin)
        self._budget, self._most = Budget(settings.budget), settings.budget
        self._keeping = Keeping(link.status)
        self._busy = 0.0
        self._shown: tuple[State, str] | None = None
        self.ended = False
        """Set by whoever wants the loop to end after its tick."""

    def run(self, until: Callable[[bool], bool]) -> None:
        """Tick until it is told to end, or nobody is left.

        Parameters
        ----------
        until : callable
            Asked about once a second, between two ticks, with whether a run is on: whether there
            is no reason to go on.
        """
        self._clock.forgive()
        self._show()
        look = time.monotonic() + LOOK
        while not self.ended:
            now = self.tick()
            if now >= look:
                look = now + LOOK
                self.ended |= until(self._cycle.state is State.RUNNING)
        self._cycle.stop()
        self.tick()
        self._show()

    def tick(self) -> float:
        """Wait for the deadline, tick, share the row; then deal with a command if there is one."""
        cycle, clock, status, ring = self._cycle, self._clock, self._status, self._link.ring
        now = clock.wait()
        cycle.tick(ring.slot, now, clock.late, self._busy, clock.missed)
        ring.publish()
        status["alive"], status["ticks"], status["missed"] = now, ring.head, clock.missed
        self._busy = busy = time.monotonic() - now
        self._keeping.note(clock.late, busy)
        if cycle.state is State.RUNNING and self._budget.exceeded(now, clock.missed):
            cycle.trip(DEADLINES, f"more than {self._most} deadlines were missed within a second")
        box = self._link.commands
        if box.submitted != box.done:
            self._obey(box.take())
            cycle.command = box.done
        if (cycle.state, cycle.reason) != self._shown:
            self._show()
        return now

    def _obey(self, command: Command | None) -> None:
        if command is None:  # it was damaged, and is refused already
            return
        reason = self._cycle.apply(command)
        outcome = Outcome.REFUSED if reason else Outcome.APPLIED
        self._link.commands.reply(command.number, outcome, self._link.ring.head, reason)
        if command.kind in SLOW:
            self._clock.forgive()
            self._budget.renew(self._clock.missed)
        self._status["law"] = self._cycle.law

    def _show(self) -> None:
        """State and reason, as the status has them."""
        cycle, status = self._cycle, self._status
        self._shown = cycle.state, cycle.reason
        status["state"], status["trip"] = cycle.state, cycle.code
        status["reason"] = cycle.reason.encode()[:TEXT]
        status["pid"] = os.getpid()
