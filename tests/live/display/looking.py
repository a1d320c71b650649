"""What the tests of the display ask of the page, and of the bench behind it."""

from __future__ import annotations

import base64

import numpy as np
from playwright.sync_api import Page

from alight.live.shared.commands import Kind
from tests.live.display.feed import RATE, Feed

PLACE = "(given) => look.place(...given)"
OFF = "(given) => look.off(...given)"
SAID = "(given) => look.said(...given)"


def here(page: Page, row: int) -> None:
    """Wait until all rows up to a number are in the browser, and drawn."""
    page.wait_for_function("(row) => alight.bench.history.end >= row", arg=row)
    drawn(page)


def drawn(page: Page) -> None:
    page.evaluate("look.drawn()")


def column(page: Page, name: str) -> np.ndarray:
    return np.frombuffer(
        base64.b64decode(page.evaluate("(name) => look.column(name)", name)), "<f4"
    )


def struck(feed: Feed) -> None:
    """A run of a second that has struck, with half a second before it."""
    feed.tick(RATE // 2)
    feed.ask(Kind.START)
    feed.tick(RATE)
