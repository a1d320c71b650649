"""Where the recorder stands: what it tells others, and what another one needs to go on."""

from __future__ import annotations

import dataclasses
import json
import os
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pydantic

from alight.files import whole_file

REPORT = "recorder.json"
"""File in the folder of the session in which the recorder says how it fares."""


@dataclass(frozen=True)
class InForce:
    """Law and parameters after the commands up to a number."""

    command: int
    law: int
    parameters: tuple[float, ...]
    certain: bool = True
    """False if a command was no longer to be had when the recorder wanted to read it."""


@dataclass(frozen=True)
class RunPlace:
    """A run that is being recorded."""

    file: str
    """Where to; its last part."""
    first: int
    """Row of the ring with which it began."""
    start: InForce
    """What was in force when it began."""
    ended: int | None = None
    """Row of the ring from which on it was no longer RUNNING."""


@dataclass(frozen=True)
class Place:
    """Everything up to ``row`` is safe: on the disk, or of no run."""

    host: str
    row: int
    """Row of the ring to take next."""
    in_force: InForce
    run: RunPlace | None = None
    lost: int = 0
    """Rows that had left the ring before they could be recorded."""


@dataclass(frozen=True)
class Report:
    """How the recorder fares."""

    state: str
    """``idle``, ``recording`` or ``failed``."""
    file: str | None
    rows: int
    seconds: float
    bytes: int
    lost: int
    problem: str
    place: Place

    def write(self, folder: Path) -> None:
        """Put it into the folder of the session, whole."""
        known = {"alive": time.monotonic(), "pid": os.getpid()}
        with whole_file(folder / REPORT) as file:
            file.write(json.dumps({**dataclasses.asdict(self), **known}).encode())


def read_report(folder: Path) -> dict[str, Any] | None:
    """What the recorder last said, as plain data; None if it has said nothing."""
    try:
        return json.loads((folder / REPORT).read_bytes())
    except (OSError, ValueError):
        return None


def read_place(folder: Path) -> Place | None:
    """Where the recorder before this one stood."""
    report = read_report(folder)
    if report is None:
        return None
    try:
        return pydantic.TypeAdapter(Place).validate_python(report.get("place"))
    except pydantic.ValidationError:
        return None
