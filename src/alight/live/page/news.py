"""What happened, as lines of the log."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from alight.live.shared.commands import Kind
from alight.live.shared.meaning import meaning_of


@dataclass(frozen=True)
class Line:
    """One line of the log."""

    number: int
    when: float
    """Seconds since the epoch."""
    t: float | None
    """Time since the start of the run [s], where it belongs to one."""
    kind: str
    text: str
    by: str = ""
    row: int | None = None
    """Row of telemetry, where it is known."""

    @property
    def clock(self) -> str:
        """Time of day, or of the run."""
        return time.strftime("%H:%M:%S", time.localtime(self.when)) if self.when else "before"


def told(kind: Kind, text: str) -> tuple[str, str]:
    """Who asked for a command, and what for, from the JSON text that it was submitted with."""
    said = meaning_of(text)
    values = said.get("values")
    return str(said.get("by", "")), _words(kind, str(said.get("law", "")), values)


def _words(kind: Kind, law: str, values: Any) -> str:
    """A command in words."""
    given = values if isinstance(values, Mapping) else {}
    if kind is Kind.KICK and "kick" in given:
        pushes = ", ".join(shown(value) for value in given["kick"])
        return f"kick {pushes} N m for {shown(given.get('duration'))} s"
    if kind in (Kind.PARAMETERS, Kind.LAW):
        changes = ", ".join(
            f"{path.removeprefix('law.').removeprefix('gains.')} = {shown(value)}"
            for path, value in given.items()
        )
        return ": ".join(part for part in (law and f"law {law}", changes) if part) or "no change"
    return kind.name.lower()


def shown(value: Any) -> str:
    """A value in few characters."""
    if isinstance(value, (list, tuple)):
        return f"({', '.join(shown(entry) for entry in value)})"
    return f"{value:.6g}" if isinstance(value, (int, float)) else str(value)
