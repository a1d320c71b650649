"""The file of a run on the disk: made without overwriting, safe after each `save`."""

from __future__ import annotations

import contextlib
import errno
import os
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

import numpy as np

from alight.files import force_folder
from alight.simulation.mcap_parts import next_part
from alight.simulation.mcap_writer import RecordingWriter
from alight.simulation.recording_description import Description
from alight.simulation.recording_events import Event


class RunFile:
    """An MCAP file that grows; what was written before a `save` survives every kill.

    Parameters
    ----------
    path : Path
        Where it shall stand; if something stands there, another name is taken.
    description : Description
        What is known when it begins.

    Raises
    ------
    OSError
        If it cannot be made; nothing of it is left then.
    """

    def __init__(self, path: Path, description: Description) -> None:
        self._description = description
        path.parent.mkdir(parents=True, exist_ok=True)
        self.path, self._file = _exclusive(path)
        self.rows, self.saved_rows, self.saved_bytes = 0, 0, 0
        try:
            self._writer = RecordingWriter(self._file, description.names)
            self._writer.describe(description.as_json())
            self.save()
            force_folder(str(self.path.parent))
        except BaseException:
            self.abandon()
            raise

    def write(self, rows: np.ndarray, first: int, events: Iterator[Event] | list[Event]) -> None:
        """Put in rows, of which the first has the number ``first`` in the run, and events."""
        for event in events:
            self._writer.event(event)
        self._writer.samples(rows, first)
        self.rows += len(rows)

    def save(self) -> None:
        """Force everything to the disk.

        Raises
        ------
        OSError
            If there is no room, or the file was taken away.
        """
        self._writer.flush()
        self._force()

    def finish(self, description: Description) -> None:
        """Say how the run ended, and close.

        Raises
        ------
        OSError
            As `save`.
        """
        self._writer.flush()
        self._writer.describe(description.as_json())
        self._writer.finish()
        self._force()
        self._file.close()

    def abandon(self) -> None:
        """Close without an end, and remove a file without rows."""
        self.leave()
        if not self.saved_rows:
            with contextlib.suppress(OSError):
                self.path.unlink()

    def leave(self) -> None:
        """Close without an end, as a kill would."""
        # What the buffer still holds may be what there was no room for: that fails once more.
        with contextlib.suppress(OSError):
            self._file.close()

    def _force(self) -> None:
        self._file.flush()
        os.fsync(self._file.fileno())
        there = os.stat(self.path)  # FileNotFoundError if it was removed
        if not os.path.samestat(there, os.fstat(self._file.fileno())):
            raise OSError(errno.ENOENT, "another file took its place", str(self.path))
        self.saved_rows, self.saved_bytes = self.rows, there.st_size


def _exclusive(path: Path) -> tuple[Path, BinaryIO]:
    """Make a file that was not there before: under this name, or with -2, -3 ... behind it."""
    for name in _names(path):
        with contextlib.suppress(FileExistsError):
            return name, open(name, "xb")
    raise AssertionError


def _names(path: Path) -> Iterator[Path]:
    if ".part" in path.stem:
        while True:
            yield path
            path = next_part(path)
    yield path
    number = 2
    while True:
        yield path.with_name(f"{path.stem}-{number}{path.suffix}")
        number += 1
