"""Chromium without a screen, as the tests of the page drive it."""

from __future__ import annotations

import contextlib
import shutil
from collections.abc import Iterator

from playwright.sync_api import Browser, sync_playwright

NAMES = ("chromium", "chromium-browser", "google-chrome")
ALONE = (
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)
"""Without them it looks for hosts of its maker's at every start."""


@contextlib.contextmanager
def browser() -> Iterator[Browser]:
    """The browser of this machine: ``make browser`` installs one on Debian."""
    found = next(filter(None, map(shutil.which, NAMES)), None)
    assert found, f"none of {', '.join(NAMES)} is installed: make browser"
    with sync_playwright() as play:
        chromium = play.chromium.launch(executable_path=found, args=list(ALONE))
        try:
            yield chromium
        finally:
            chromium.close()
