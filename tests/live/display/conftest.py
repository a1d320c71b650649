"""A bench that ticks when told to, a server, and a browser that looks at it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page

from tests.live.browser import browser as started
from tests.live.display.feed import Feed
from tests.live.display.served import serve


@pytest.fixture
def feed(tmp_path: Path) -> Feed:
    return Feed(tmp_path / "host-1")


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with started() as chromium:
        yield chromium


@pytest.fixture
def look(browser: Browser) -> Iterator[Callable[..., Page]]:
    """Opens the display on a source; afterwards nothing was said, and nobody else was asked."""
    said: list[str] = []
    asked: list[str] = []
    with ExitStack() as stack:

        def open_page(source_of: Callable, width: int = 920, height: int = 700) -> Page:
            server = stack.enter_context(serve(source_of))
            page = browser.new_page(viewport={"width": width, "height": height})
            stack.callback(page.close)
            page.on("console", lambda message: said.append(message.text))
            page.on("pageerror", lambda error: said.append(str(error)))
            page.on("request", lambda request: asked.append(request.url))
            page.on("websocket", lambda socket: asked.append(socket.url))
            page.add_init_script(path=Path(__file__).parent / "look.js")
            page.goto(server.url)
            page.wait_for_function("globalThis.alight?.bench.history?.started")
            return page

        yield open_page
    assert said == []
    assert asked, "the page asked for its scripts at least"
    assert [url for url in asked if not url.split("//")[1].startswith("127.0.0.1:")] == []
