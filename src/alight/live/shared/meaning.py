"""What a command means to a person: the text that it was submitted with, and the kind of event."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from alight.live.shared.commands import Kind
from alight.simulation.recording_events import EventKind

EVENT_OF: Mapping[Kind, EventKind] = {
    Kind.START: EventKind.START,
    Kind.STOP: EventKind.STOP,
    Kind.RESET: EventKind.RESET,
    Kind.KICK: EventKind.KICK,
    Kind.PARAMETERS: EventKind.GAINS,
    Kind.LAW: EventKind.LAW,
}


def meaning_of(text: str) -> dict[str, Any]:
    """What the text of a command says: ``by``, ``law``, ``values``; empty if it is none of ours."""
    try:
        found = json.loads(text)
    except ValueError:
        return {}
    return found if isinstance(found, dict) else {}
