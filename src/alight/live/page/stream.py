"""Telemetry to the browser: what the signals are, and their rows as fast as the reader asks."""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import struct
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from starlette.applications import Starlette
from starlette.requests import HTTPConnection, Request
from starlette.responses import JSONResponse, PlainTextResponse, Response
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.websockets import WebSocket, WebSocketDisconnect

from alight.live.page.describe import describe
from alight.live.page.drawn import Drawn
from alight.live.page.source import Source, plain_event

STATIC = Path(__file__).parent / "static"
STATIC_PATH, LAYOUT_PATH, SOCKET_PATH = "/live/static", "/live/layout.json", "/live/telemetry"

MOST_STREAMS = 64
LONGEST = 16384
"""Bytes of a message from a client."""
SECONDS = 2.0
"""Length of what one message carries at most [s]."""
LAG, PATIENCE = 4.0, 30
"""A client this far behind [s], and not gaining on it for so many messages, skips ahead."""
IDLE = 300.0
"""Seconds without a word after which a socket is closed; a hidden page speaks once a minute."""
SENDING = 30.0
"""Seconds after which a client that does not take its message is given up."""
FIRST_WORD = 15.0
"""Seconds in which a new socket must say what it wants."""

HEADER = struct.Struct("<ddII")
"""Number of the first row, rows there are, rows in this message, columns; then the columns one
after the other as float32, all little-endian."""

POLICY, TOO_BIG, BUSY = 1008, 1009, 1013
"""Close codes of RFC 6455 and its registry."""

_log = logging.getLogger(__name__)


class _Malformed(Exception):
    """A message that no client of ours sends."""

    def __init__(self, reason: str, code: int = POLICY) -> None:
        super().__init__(reason)
        self.code = code


@dataclass
class _Wanted:
    """What a client subscribed to, and how far it is."""

    source: Source
    columns: np.ndarray
    row: int
    behind: float = 0.0
    """How far it was behind the last time [s]."""
    losing: int = 0
    """Messages in a row by which it was far behind and did not gain."""
    told: int = 0
    """Row from which on events are still to be told."""
    known: set[tuple[Any, ...]] = field(default_factory=set)


class Streams:
    """The sockets through which browsers read a source.

    A client says what it wants (``{"columns": [...], "since": row, "generation": n}``), then asks
    for each message (``{"next": row}``): a slow one gets fewer of them, and nothing queues. One
    that has no clock (a hidden page) may add ``"wait": seconds``.
    """

    def __init__(
        self,
        source_of: Callable[[], Source | None],
        authorised: Callable[[HTTPConnection], bool] | None = None,
        most: int = MOST_STREAMS,
    ) -> None:
        self._source_of = source_of
        self._authorised = authorised or (lambda _: True)
        self._most = most
        self._open = 0
        self._generation = 0
        self._newest: Drawn | None = None

    @property
    def count(self) -> int:
        """Sockets that are open."""
        return self._open

    def current(self) -> tuple[int, Drawn | None]:
        """The source there is now, and how many there have been."""
        source = self._source_of()
        if source is None:
            return self._generation, None
        if self._newest is None or source is not self._newest.source:
            self._newest, self._generation = Drawn(source), self._generation + 1
        return self._generation, self._newest

    async def layout(self, request: Request) -> Response:
        """What the columns mean, and everything else that the display needs once."""
        if not self._authorised(request):
            return PlainTextResponse("not permitted", 403)
        generation, source = self.current()
        if source is None:
            return JSONResponse({"problem": "there is no host yet"}, 503)
        return JSONResponse({**describe(source), "generation": generation}, headers=_FRESH)

    async def telemetry(self, socket: WebSocket) -> None:
        """Serve one client until it goes."""
        if not self._authorised(socket):
            await socket.close(POLICY)
            return
        await socket.accept()
        if self._open >= self._most:
            await socket.close(BUSY, f"{self._most} displays are open already; close one")
            return
        self._open += 1
        try:
            await self._serve(socket)
        except _Malformed as problem:
            _log.warning("a display was closed: %s", problem)
            await _close(socket, problem.code, str(problem))
        except TimeoutError:
            await _close(socket, POLICY, "nothing was heard for long")
        except (WebSocketDisconnect, RuntimeError, OSError):
            pass  # it went while we wrote
        finally:
            self._open -= 1

    async def _serve(self, socket: WebSocket) -> None:
        wanted: _Wanted | None = None
        while True:
            message = await _heard(socket, FIRST_WORD if wanted is None else IDLE)
            generation, source = self.current()
            if "columns" in message:
                wanted = _subscribed(message, source)
                if source is None or message.get("generation", generation) != generation:
                    wanted = None
            elif wanted is None and "next" not in message:
                raise _Malformed("a display first says which columns it wants")
            if wanted is None or source is not wanted.source:
                wanted = None
                await _send(socket, _changed(generation, source))
            else:
                await self._answer(socket, wanted, message)

    async def _answer(self, socket: WebSocket, wanted: _Wanted, message: dict[str, Any]) -> None:
        if "next" in message:
            wanted.row = _whole(message["next"], "next")
        if "wait" in message:
            await asyncio.sleep(_seconds(message["wait"]))
        _skip(wanted)
        most = max(1, round(SECONDS / wanted.source.dt))
        first, rows = wanted.source.read(wanted.row, most)
        head = wanted.source.head
        header = HEADER.pack(first, head, len(rows), len(wanted.columns))
        for event in _news(wanted, first + len(rows)):
            await _send(socket, json.dumps({"event": event}))
        picked = rows[:, wanted.columns].T
        with np.errstate(over="ignore"):
            await _send(socket, header + picked.astype("<f4").tobytes())


def mount_stream(
    app: Starlette,
    source_of: Callable[[], Source | None],
    authorised: Callable[[HTTPConnection], bool] | None = None,
    most: int = MOST_STREAMS,
) -> Streams:
    """Add the display's routes to an application, before those that it has.

    Parameters
    ----------
    app : Starlette
        NiceGUI's ``app``, or any other application of Starlette or FastAPI.
    source_of : callable
        The source there is now; another object where a host was started anew, None without one.
    authorised : callable, optional
        Whether a request or socket may read; everybody if absent.
    most : int
        Displays that may be open at once.
    """
    streams = Streams(source_of, authorised, most)
    app.router.routes[:0] = [
        Route(LAYOUT_PATH, streams.layout),
        WebSocketRoute(SOCKET_PATH, streams.telemetry),
        Mount(STATIC_PATH, _Fresh(directory=STATIC)),
    ]
    return streams


_FRESH = {"Cache-Control": "no-cache"}


class _Fresh(StaticFiles):
    """Files that the browser asks about each time, so that an update is seen."""

    def file_response(self, *args: Any, **kwargs: Any) -> Response:
        response = super().file_response(*args, **kwargs)
        response.headers.update(_FRESH)
        return response


async def _heard(socket: WebSocket, seconds: float) -> dict[str, Any]:
    """The next message of a client."""
    received = await asyncio.wait_for(socket.receive(), seconds)
    if received["type"] == "websocket.disconnect":
        raise WebSocketDisconnect(received.get("code", 1000))
    text = received.get("text")
    if text is None:
        raise _Malformed("messages are JSON text")
    if len(text) > LONGEST:
        raise _Malformed(
            f"a message has {len(text)} characters, at most {LONGEST} are read", TOO_BIG
        )
    try:
        message = json.loads(text)
    except (ValueError, RecursionError):
        message = None
    if not isinstance(message, dict):
        raise _Malformed("a message is no JSON object")
    return message


def _subscribed(message: dict[str, Any], source: Source | None) -> _Wanted | None:
    """What a client wants of a source."""
    names, since = message["columns"], message.get("since", 0)
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise _Malformed("columns is a list of names")
    row = _whole(since, "since")
    if source is None:
        return None
    place = {name: i for i, name in enumerate(source.layout.columns)}
    if len(names) > len(place) or any(name not in place for name in names):
        unknown = [name for name in names if name not in place][:1]
        raise _Malformed(f"no such column: {unknown[0][:40]!r}" if unknown else "too many columns")
    return _Wanted(source, np.array([place[name] for name in names], dtype=int), row, told=row)


def _whole(value: object, name: str) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < 2**53:
        raise _Malformed(f"{name} is the number of a row, from 0")
    return value


def _seconds(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value <= SECONDS:
        raise _Malformed(f"wait is a number of seconds, {SECONDS:g} at most")
    return float(value)


def _skip(wanted: _Wanted) -> None:
    """Let a client that cannot keep up go on at the newest rows; the gap shows in its header."""
    source = wanted.source
    behind = (source.head - wanted.row) * source.dt
    losing = source.mode == "live" and behind > LAG and behind >= wanted.behind
    wanted.losing, wanted.behind = wanted.losing + 1 if losing else 0, behind
    if wanted.losing > PATIENCE:
        wanted.row = max(0, source.head - round(SECONDS / source.dt))
        wanted.losing, wanted.behind = 0, SECONDS


def _news(wanted: _Wanted, row: int) -> list[dict[str, Any]]:
    """Events that this client has not been told, those of rows still to come excepted."""
    told: list[dict[str, Any]] = []
    for event in wanted.source.events(wanted.told):
        plain = plain_event(event)
        key = (plain["row"], plain["kind"], plain.get("number"))
        if key not in wanted.known and plain["row"] <= row:
            wanted.known.add(key)
            told.append(plain)
    # One that is told late (its row was read before it was answered) is at most a second old.
    wanted.told = max(wanted.told, row - round(1 / wanted.source.dt))
    wanted.known = {key for key in wanted.known if key[0] >= wanted.told}
    return told


def _changed(generation: int, source: Source | None) -> str:
    """Word to a client that the source it reads is gone: it is to read the layout again."""
    return json.dumps({"changed": generation if source is not None else None})


async def _send(socket: WebSocket, content: str | bytes) -> None:
    """Send, and give up on a client that does not read."""
    sending = socket.send_text(content) if isinstance(content, str) else socket.send_bytes(content)
    await asyncio.wait_for(sending, SENDING)


async def _close(socket: WebSocket, code: int, reason: str) -> None:
    gone = (RuntimeError, OSError, TimeoutError, WebSocketDisconnect)
    with contextlib.suppress(*gone):
        await asyncio.wait_for(socket.close(code, reason[:120]), FIRST_WORD)
