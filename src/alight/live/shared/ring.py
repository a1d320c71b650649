"""The telemetry ring: one process writes a row at each tick, others read, nobody waits."""

from __future__ import annotations

import threading
from pathlib import Path

import numpy as np

from alight.files import FileError
from alight.live.shared.block import create_block, open_block

HEADER = 8
"""Doubles before the first row: width, capacity and the number of rows written; rest unused."""
WORD = np.dtype(np.float64)
UNSURE = 2
"""The row after the newest may be under way, where the oldest stood; and of the newest the count
may be seen later than the row that follows it, on processors that order the two as they like."""


class TelemetryRing:
    """Rows of doubles in shared memory, written by one process and read by any number.

    The writer fills `slot` and calls `publish`. It never looks at the readers: one that falls
    behind by more than ``capacity`` rows loses the oldest, and is told so by the number of the
    first row that it gets.
    """

    def __init__(self, block: np.ndarray) -> None:
        self._width, self._capacity = int(block[0]), int(block[1])
        self._written = block[2:3].view(np.uint64)
        self._rows = block[HEADER:].reshape(self._capacity, self._width)
        # Taking a lock that nobody else has is a memory barrier on every processor: a row is
        # seen before the count that announces it.
        self._barrier = threading.Lock()
        self._next = self.head
        self.slot = self._rows[self._next % self._capacity]
        """The row to fill next; the writer's."""

    @classmethod
    def create(cls, path: Path, width: int, capacity: int) -> TelemetryRing:
        """Make a ring for rows of ``width`` doubles that keeps the last ``capacity``."""
        block = create_block(path, WORD, HEADER + width * capacity)
        block[:2] = width, capacity
        return cls(block)

    @classmethod
    def open(cls, path: Path) -> TelemetryRing:
        """Attach to a ring that another process made.

        Raises
        ------
        FileError
            If there is none, or it is not whole.
        """
        block = open_block(path, WORD)
        whole = len(block) >= HEADER and (block[:2] >= 1).all()
        if not whole or HEADER + block[0] * block[1] != len(block):
            raise FileError(path, "is no telemetry ring")
        return cls(block)

    @property
    def width(self) -> int:
        """Doubles in a row."""
        return self._width

    @property
    def capacity(self) -> int:
        """Rows that are kept."""
        return self._capacity

    @property
    def head(self) -> int:
        """Number of rows written so far."""
        return int(self._written[0])

    def publish(self) -> None:
        """Announce the row that stands in `slot`, and turn to the next one."""
        with self._barrier:
            pass
        self._next += 1
        self._written[0] = self._next
        self.slot = self._rows[self._next % self._capacity]

    def read(self, first: int, most: int | None = None) -> tuple[int, np.ndarray]:
        """Copy the rows from number ``first`` on, at most ``most`` of them.

        Returns
        -------
        first : int
            Number of the first row returned: later than asked for where rows were overwritten.
        rows : (n, width) array
            A copy, in order; empty if there is nothing new.
        """
        head = self.head
        with self._barrier:
            pass
        first = max(first, head - self._capacity + UNSURE)
        last = head if most is None else min(head, first + most)
        if last <= first:
            return first, np.empty((0, self._width))
        rows = self._rows[np.arange(first, last) % self._capacity]
        with self._barrier:
            pass
        lost = min(max(self.head - self._capacity + UNSURE - first, 0), len(rows))
        return first + lost, rows[lost:]
