"""Absolute deadlines, and how well they are kept."""

from __future__ import annotations

import time
from bisect import bisect_right
from collections import deque
from typing import Any

import numpy as np

from alight.live.shared.status import EDGES

_EDGES = EDGES[1:].tolist()


class Clock:
    """Deadlines at multiples of a period from its making on.

    A tick that takes longer than what is left of its period costs whole periods: they are skipped
    and counted, so that the ticks that follow stand on the same grid.

    Parameters
    ----------
    period : float
        Time between two deadlines [s].
    spin : float
        How long before a deadline the clock ceases to sleep, and looks at the time instead [s].

    Attributes
    ----------
    late : float
        How much later than its deadline the present tick began [s].
    missed : int
        Deadlines at which no tick began.
    """

    def __init__(self, period: float, spin: float = 0.0) -> None:
        self._period, self._spin = period, spin
        self._deadline = time.monotonic() + period
        self.late, self.missed = 0.0, 0

    def wait(self) -> float:
        """Wait for the next deadline that has not passed by a period or more.

        Returns
        -------
        float
            The time at which the tick begins, on the clock ``time.monotonic`` [s].
        """
        now = time.monotonic()
        if now - self._deadline >= self._period:
            skipped = int((now - self._deadline) / self._period)
            self._deadline += skipped * self._period
            self.missed += skipped
        while (left := self._deadline - now) > 0:
            if left > self._spin:
                time.sleep(left - self._spin)
            now = time.monotonic()
        self.late = now - self._deadline
        self._deadline += self._period
        return now

    def forgive(self) -> None:
        """Begin anew: the time since the last deadline was not that of a tick."""
        self._deadline = time.monotonic() + self._period


class Keeping:
    """Histograms and extremes of a status, renewed at each tick."""

    def __init__(self, status: Any) -> None:
        self._status = status
        self._late: np.ndarray = status["late_counts"]
        self._busy: np.ndarray = status["busy_counts"]
        self._worst_late = self._worst_busy = 0.0

    def note(self, late: float, busy: float) -> None:
        """Count a tick that began ``late`` and took ``busy`` [s]."""
        self._late[bisect_right(_EDGES, late)] += 1
        self._busy[bisect_right(_EDGES, busy)] += 1
        if late > self._worst_late:
            self._worst_late = self._status["worst_late"] = late
        if busy > self._worst_busy:
            self._worst_busy = self._status["worst_busy"] = busy


class Budget:
    """How many deadlines may be missed within any second."""

    def __init__(self, most: int) -> None:
        self._most, self._seen, self._within = most, 0, 0
        self._misses: deque[tuple[float, int]] = deque()

    def exceeded(self, now: float, missed: int) -> bool:
        """Whether more have been missed than allowed, given the time and their total so far."""
        if missed == self._seen:
            return False
        self._misses.append((now, missed - self._seen))
        self._within += missed - self._seen
        self._seen = missed
        while now - self._misses[0][0] > 1.0:
            self._within -= self._misses.popleft()[1]
        return self._within > self._most

    def renew(self, missed: int) -> None:
        """Forget what was missed."""
        self._misses.clear()
        self._seen, self._within = missed, 0
