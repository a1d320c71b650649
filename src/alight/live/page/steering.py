"""Who steers: one page at a time; all others watch."""

from __future__ import annotations

from collections.abc import Callable


class Steering:
    """One page steers until it goes or another takes over; the server enforces it."""

    def __init__(self) -> None:
        self._names: dict[str, str] = {}
        self._open: set[str] = set()
        self._made = 0
        self._holder: str | None = None
        self._listeners: list[Callable[[str], None]] = []

    def join(self, client: str, address: str) -> str:
        """Let a page in, or in again; it steers if nobody does. Returns the name it goes by."""
        if client not in self._names:
            self._made += 1
            self._names[client] = f"page {self._made} ({address})"
        self._open.add(client)
        if self._holder is None:
            self._give(client)
        return self._names[client]

    def leave(self, client: str) -> None:
        """A page is not to be heard; control is free if it was the one that steered."""
        self._open.discard(client)
        if self._holder == client:
            self._holder = None
            self._tell("nobody steers: the page that did has gone")

    def forget(self, client: str) -> None:
        """A page has gone for good."""
        self.leave(client)
        self._names.pop(client, None)

    def take(self, client: str) -> None:
        """Hand control to a page; the one that had it loses it."""
        if client in self._open and client != self._holder:
            self._give(client)

    def steers(self, client: str) -> bool:
        """Whether a page is the one that steers."""
        return self._holder is not None and client == self._holder

    def name(self, client: str) -> str:
        """What a page goes by."""
        return self._names.get(client, "a page that has gone")

    @property
    def holder(self) -> str:
        """Name of the page that steers; empty if none does."""
        return "" if self._holder is None else self.name(self._holder)

    @property
    def watching(self) -> int:
        """Number of pages that are open and do not steer."""
        return len(self._open) - (self._holder is not None)

    def listen(self, listener: Callable[[str], None]) -> None:
        """Be told of every change of hands, in a sentence."""
        self._listeners.append(listener)

    def _give(self, client: str) -> None:
        self._holder = client
        self._tell(f"{self._names[client]} steers")

    def _tell(self, what: str) -> None:
        for listener in self._listeners:
            listener(what)
