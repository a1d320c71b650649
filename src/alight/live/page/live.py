"""The page of a running bench, put together."""

from __future__ import annotations

import asyncio
from typing import Any

from nicegui import Client, app, ui
from nicegui.client import ClientConnectionTimeout

from alight.errors import AlightError
from alight.live.page.bench import Bench
from alight.live.page.element import add_display_head
from alight.live.page.guard import is_loopback
from alight.live.page.preview import Preview
from alight.live.page.serve import every, listen, make_app, quiet, serve, stand_back
from alight.live.page.steering import Steering
from alight.live.page.stream import STATIC_PATH, mount_stream
from alight.live.page.view import View
from alight.live.session import Session

POLL = 0.1
"""Time [s] between two looks at the host."""
PATIENCE = 10.0
"""Time [s] in which the browser must come back to a page that it asked for."""


def serve_bench(session: Session) -> None:
    """Serve the page of a session until SIGTERM.

    Raises
    ------
    AlightError
        If others could reach it without a token, or its port is taken.
    """
    settings = session.settings
    if settings.token is None and not is_loopback(settings.host):
        raise AlightError(f"{settings.host}: others can reach this address; give a token")
    quiet()
    stand_back(settings.core)
    bench = Bench(session)
    steering, preview = Steering(), Preview(bench.scenario)
    steering.listen(lambda what: bench.log("steering", what))
    made = make_app(f"Alight live: {bench.scenario.name}")
    mount_stream(app, lambda: bench.source)
    tasks: set[Any] = set()

    def begin() -> None:
        loop = asyncio.get_running_loop()
        tasks.add(loop.create_task(every(POLL, bench.poll)()))
        # The first certificate derives what the others only evaluate.
        tasks.add(loop.create_task(asyncio.to_thread(preview.of, bench.in_force.loop.law)))

    @ui.page("/")
    async def page(client: Client) -> None:
        add_head()
        if not await connected(client):
            return
        steering.join(client.id, client.ip)
        client.on_disconnect(lambda: steering.leave(client.id))
        client.on_connect(lambda: steering.join(client.id, client.ip))
        client.on_delete(lambda: steering.forget(client.id))
        View(bench, steering, preview, client)

    app.on_startup(begin)
    serve(made, listen(settings.host, settings.port), settings.token)


async def connected(client: Client) -> bool:
    """Wait for the browser that asked for a page; one that does not come is forgotten."""
    try:
        await client.connected(timeout=PATIENCE)
    except ClientConnectionTimeout:
        client.delete()
    return not client.is_deleted


def add_head() -> None:
    """Add what every page needs to its head."""
    add_display_head()
    ui.add_head_html(
        f'<link rel="stylesheet" href="{STATIC_PATH}/panels.css">'
        f'<script type="module" src="{STATIC_PATH}/panels.js"></script>'
    )
