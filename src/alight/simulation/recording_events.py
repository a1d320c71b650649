"""What happened in a run at one of its samples: a start, a change of gains, a trip."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any


class EventKind(StrEnum):
    """What an event is about."""

    START = "start"
    STOP = "stop"
    RESET = "reset"
    KICK = "kick"
    GAINS = "gains"
    TARGET = "target"
    LAW = "law"
    REFUSED = "refused"
    TRIP = "trip"
    HOST_LOST = "host lost"
    ROWS_LOST = "rows lost"
    RECORDER = "recorder"


@dataclass(frozen=True)
class Event:
    """Something that happened in a run.

    Numbers are SI, and finite.
    """

    row: int
    """Number of the first sample that shows it, counted from the start of the run."""
    t: float
    """Time of that sample [s]."""
    kind: str
    """One of `EventKind`."""
    text: str
    """What a person would want to read."""
    number: int = 0
    """Number of the command behind it, 0 if nobody asked for it."""
    law: str = ""
    """Name of the law that it is about, or that is in force after it."""
    values: tuple[float, ...] = ()
    """The numbers that were sent: every parameter of the law, a kick, the code of a trip."""
    changes: Mapping[str, Any] = field(default_factory=dict)
    """Parameters that it changed, by path, and what they became."""

    def as_dict(self) -> dict[str, Any]:
        """The event as plain data."""
        return dataclasses.asdict(self)

    def as_json(self) -> str:
        """The event as JSON, as files keep it."""
        return json.dumps(self.as_dict(), allow_nan=False)


SCHEMA = {
    "title": "alight.Event",
    "type": "object",
    "properties": {
        "row": {"type": "integer", "description": "first sample that shows it"},
        "t": {"type": "number", "description": "time of that sample [s]"},
        "kind": {"type": "string", "description": f"one of: {', '.join(EventKind)}"},
        "text": {"type": "string"},
        "number": {"type": "integer", "description": "number of the command behind it, or 0"},
        "law": {"type": "string", "description": "the law that it is about"},
        "values": {"type": "array", "items": {"type": "number"}},
        "changes": {"type": "object", "description": "parameters by path"},
    },
    "required": ["row", "t", "kind", "text"],
}
"""JSON Schema of an event, for the viewers of MCAP files."""
