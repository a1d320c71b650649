"""The server of the page: NiceGUI behind a guard, everything from this machine."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import resource
import socket
from collections.abc import Callable
from typing import Any

import uvicorn
from fastapi import FastAPI

from alight.errors import AlightError
from alight.live.page.guard import Guard
from alight.live.page.limited import LimitedProtocol

MOST_PAGES = 24
"""Pages that may be open, or about to be."""
NICENESS = 5
BACKLOG = 256
RECONNECT = 15.0
"""Time [s] for which a page that fell silent is kept: a browser on a loaded machine may not answer
for seconds, and one that has to load the page anew loses its history."""


def serve(
    app: FastAPI,
    listening: socket.socket,
    token: str | None,
    ready: Callable[[], None] = lambda: None,
) -> None:
    """Serve until SIGTERM.

    Parameters
    ----------
    app : FastAPI
        With NiceGUI mounted.
    listening : socket
        As `listen` makes it.
    token : str or None
        See `Guard`.
    ready : callable
        Called when the page can be opened.
    """
    from nicegui import Client

    guarded = Guard(app, token, lambda: len(Client.instances) >= MOST_PAGES)
    config = uvicorn.Config(
        guarded,
        http=LimitedProtocol,
        ws="websockets-sansio",
        ws_max_size=1 << 17,
        ws_per_message_deflate=False,
        h11_max_incomplete_event_size=1 << 15,
        log_level="warning",
        access_log=False,
        server_header=False,
        timeout_graceful_shutdown=2,
        lifespan="on",
    )
    server = uvicorn.Server(config)

    async def run() -> None:
        task = asyncio.create_task(server.serve([listening]))
        while not server.started and not task.done():
            await asyncio.sleep(0.02)
        ready()
        await task

    asyncio.run(run())


def listen(host: str, port: int) -> socket.socket:
    """Listen on a port, any free one for 0.

    Raises
    ------
    AlightError
        If it cannot be had.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    made = socket.socket(family, socket.SOCK_STREAM)
    made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        made.bind((host, port))
        made.listen(BACKLOG)
    except OSError as error:
        made.close()
        raise AlightError(f"cannot listen on {host}, port {port}: {error.strerror}") from error
    return made


def address(listening: socket.socket) -> str:
    """Where the page can be opened."""
    host, port = listening.getsockname()[:2]
    return f"http://{f'[{host}]' if ':' in host else host}:{port}/"


def make_app(title: str) -> FastAPI:
    """An application with NiceGUI mounted: nothing stored, nothing fetched from elsewhere."""
    from nicegui import app as nicegui_app
    from nicegui import ui

    made = FastAPI(openapi_url=None, docs_url=None, redoc_url=None)
    nicegui_app.config.socket_io_js_transports = ["websocket"]
    ui.run_with(
        made,
        title=title,
        favicon=FAVICON,
        dark=True,
        tailwind=False,
        reconnect_timeout=RECONNECT,
        binding_refresh_interval=None,
        message_history_length=100,
        show_welcome_message=False,
        gzip_middleware_factory=None,
    )
    return made


FAVICON = (
    '<svg viewBox="0 0 32 32" xmlns="http://www.w3.org/2000/svg"><rect width="32" height="32" '
    'rx="5" fill="#171c22"/><path d="M5 8c7 0 9 15 15 15h7" fill="none" stroke="#5aa9e6" '
    'stroke-width="3" stroke-linecap="round"/><path d="M4 27h24" stroke="#e2964a" '
    'stroke-width="2.5" stroke-linecap="round"/></svg>'
)


def stand_back(core: int | None) -> None:
    """Leave the host its core, and everybody else the right of way."""
    with contextlib.suppress(OSError):
        os.nice(NICENESS)
    if hasattr(os, "sched_setaffinity"):
        allowed = os.sched_getaffinity(0)
        others = allowed - {max(allowed) if core is None else core}
        if others:
            with contextlib.suppress(OSError):
                os.sched_setaffinity(0, others)
    with contextlib.suppress(OSError, ValueError):
        _, most = resource.getrlimit(resource.RLIMIT_NOFILE)
        resource.setrlimit(resource.RLIMIT_NOFILE, (most, most))


def quiet() -> None:
    """What libraries log goes to stderr, warnings and worse only."""
    logging.basicConfig(level=logging.WARNING, format="page: %(message)s")
    logging.getLogger("engineio").setLevel(logging.ERROR)
    logging.getLogger("socketio").setLevel(logging.ERROR)
    logging.getLogger("uvicorn.error").setLevel(logging.ERROR)  # one line for each bad request


def every(seconds: float, what: Callable[[], Any]) -> Callable[[], Any]:
    """A task that does something again and again; what goes wrong is logged, and it goes on."""

    async def repeat() -> None:
        while True:
            try:
                what()
            except Exception:
                logging.getLogger(__name__).exception("the page could not follow the bench")
            await asyncio.sleep(seconds)

    return repeat
