"""Where the page's telemetry comes from: a host that runs, or a recording that plays."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np

from alight.live.session import Link
from alight.live.shared.commands import Kind, Outcome
from alight.live.shared.meaning import EVENT_OF, meaning_of
from alight.live.shared.status import State
from alight.scenarios import Scenario
from alight.simulation.recording_events import Event, EventKind
from alight.symbolic.signals import Layout

MOST_EVENTS = 2000
"""Events that are kept; older ones are forgotten."""


class Source(Protocol):
    """Rows of telemetry by number, and what happened between them."""

    @property
    def mode(self) -> str:
        """``live`` or ``replay``."""

    @property
    def scenario(self) -> Scenario:
        """What runs, or ran."""

    @property
    def layout(self) -> Layout:
        """What a row holds."""

    @property
    def dt(self) -> float:
        """Time between two rows [s]."""

    @property
    def head(self) -> int:
        """Number of rows there are up to now."""

    def read(self, first: int, most: int | None = None) -> tuple[int, np.ndarray]:
        """Rows from number ``first`` on, at most ``most``: number of the first one, and the rows.

        The first is a later one than asked for where the older are no longer kept.
        """

    def events(self, since: int) -> Sequence[Any]:
        """What happened at row ``since`` or later, in order.

        Each is a mapping with the fields of `Event`, of which ``row``, ``kind``, ``text``,
        ``number`` and ``changes`` are read; or an `Event`.
        """


class LiveSource:
    """The ring of a host, and the commands that it dealt with."""

    mode = "live"

    def __init__(self, link: Link, scenario: Scenario) -> None:
        self.link = link
        self.scenario = scenario
        self.dt = 1.0 / scenario.testbed.sample_rate
        self._events: list[dict[str, Any]] = []
        self._next = max(1, link.commands.done - MOST_EVENTS // 4)
        self._tripped = False

    @property
    def layout(self) -> Layout:
        """What a row holds."""
        return self.link.layout

    @property
    def head(self) -> int:
        """Number of rows written up to now."""
        return self.link.ring.head

    def read(self, first: int, most: int | None = None) -> tuple[int, np.ndarray]:
        """Rows from number ``first`` on, as `TelemetryRing.read`."""
        return self.link.ring.read(first, most)

    def events(self, since: int) -> list[dict[str, Any]]:
        """Commands that were dealt with and trips, from row ``since`` on."""
        self._follow()
        return [event for event in self._events if event["row"] >= since]

    def _follow(self) -> None:
        commands = self.link.commands
        while self._next <= commands.done:
            kind, answer = commands.kind_of(self._next), commands.answer(self._next)
            if kind is not None:
                event = _command_event(kind, commands.text_of(self._next))
                if answer.outcome is Outcome.REFUSED:
                    event |= {"kind": EventKind.REFUSED, "text": answer.reason}
                self._events.append({**event, "row": answer.tick, "number": self._next})
            self._next += 1
        tripped = int(self.link.status["state"]) == State.TRIPPED
        if tripped and not self._tripped:
            reason = bytes(self.link.status["reason"]).decode(errors="replace")
            self._events.append({"row": self.head, "kind": EventKind.TRIP, "text": reason})
        self._tripped = tripped
        del self._events[:-MOST_EVENTS]


def _command_event(kind: Kind, text: str) -> dict[str, Any]:
    """What a command says of itself: the JSON text that its submitter gave it, as far as it is."""
    said = meaning_of(text)
    changes = said.get("values")
    return {
        "kind": EVENT_OF[kind],
        "text": str(said.get("law", "")),
        "changes": changes if isinstance(changes, dict) else {},
    }


def plain_event(event: Any) -> dict[str, Any]:
    """An event as the display reads it."""
    found = event.as_dict() if isinstance(event, Event) else event
    names = ("row", "kind", "text", "number", "changes")
    return {name: found[name] for name in names if name in found}
