"""A real server with the display's routes, on a free port of this machine, in a thread."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import uvicorn
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import HTMLResponse
from starlette.routing import Route

from alight.live.page.stream import Streams, mount_stream

PAGE = """<!doctype html><html lang="en"{theme}><head><meta charset="utf-8"><title>bench</title>
<link rel="icon" href="data:,"><link rel="stylesheet" href="/live/static/bench.css">
<script type="module" src="/live/static/bench.js"></script>
<style>body {{ margin: 0; height: 100vh; display: grid; grid-template-columns: 300px 1fr; gap: 8px;
background: var(--al-ground); padding: 6px; box-sizing: border-box; overflow: hidden; }}</style>
</head>
<body><alight-plan></alight-plan><alight-scopes hotkeys></alight-scopes></body></html>"""


class Server:
    def __init__(self, url: str, streams: Streams) -> None:
        self.url, self.streams = url, streams


@contextmanager
def serve(source_of: Callable, authorised: Callable | None = None, most: int = 64) -> Iterator:
    """Serve a page with both elements and what they read, until the block ends."""

    def page(request: Request) -> HTMLResponse:
        theme = ' data-theme="light"' if "light" in request.query_params else ""
        return HTMLResponse(PAGE.format(theme=theme))

    app = Starlette(routes=[Route("/", page)])
    streams = mount_stream(app, source_of, authorised, most)
    config = uvicorn.Config(
        app,
        host="127.0.0.1",
        port=0,
        log_level="critical",
        ws="websockets-sansio",
        lifespan="off",
        timeout_graceful_shutdown=1,
    )
    server = uvicorn.Server(config)
    thread = threading.Thread(target=server.run, daemon=True)
    thread.start()
    while not server.started:
        time.sleep(0.01)
    port = server.servers[0].sockets[0].getsockname()[1]
    try:
        yield Server(f"http://127.0.0.1:{port}", streams)
    finally:
        server.should_exit = True
        thread.join(10)
