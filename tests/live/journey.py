"""A run from start to recording, driven on the page: ``python -m tests.live.journey PICTURE``."""

from __future__ import annotations

import io
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from PIL import Image
from playwright.sync_api import expect

import alight
from alight.files import whole_file
from alight.live.shared.commands import Kind
from tests.live.bench import columns, gather, supervised, wait_for
from tests.live.browser import browser

SIZE = {"width": 1280, "height": 800}
COLOURS = 128
ALPHA1 = 31.0
"""Satisfies LOC, which that of the experiment does not."""


@dataclass(frozen=True)
class Journey:
    """What came of it."""

    recording: alight.Recording
    path: Path
    tick: int
    """Row of telemetry at which the gain took effect."""
    began: int
    """Row at which the run began."""
    pictures: dict[str, bytes]


def journey(folder: Path) -> Journey:
    """Start experiment 1, see contact, change a gain in mid-run, stop, reset; keep the pictures."""
    pictures = {}
    with supervised(folder) as bench, browser() as chromium:
        link = bench.link()
        page = chromium.new_page(viewport=SIZE)
        page.goto(bench.url)
        expect(page.get_by_text("You steer")).to_be_visible(timeout=30_000)
        page.get_by_role("button", name="Start", exact=True).click()
        expect(page.get_by_role("status")).to_have_text("RUNNING")
        began = link.commands.answer(link.commands.done).tick
        touched = columns(link, "Lambda")
        wait_for(lambda: gather(link, link.ring.head - 100, 100)[:, touched].all())
        page.locator("#field-law-gains-alpha1 input[type=text]").fill(str(ALPHA1))
        expect(page.locator(".al-certificate")).to_contain_text("holds")
        page.wait_for_timeout(5000)
        pictures["draft"] = page.screenshot()
        page.locator(".al-actions button.primary").click()
        expect(page.locator(".al-panel > .al-outcome")).to_contain_text("in force since tick")
        tick = link.commands.answer(link.commands.done).tick
        page.wait_for_timeout(2000)
        pictures["applied"] = page.screenshot()
        page.keyboard.press("Escape")
        expect(page.get_by_role("status")).to_have_text("STOPPED")
        page.get_by_role("button", name="Reset", exact=True).click()
        expect(page.get_by_role("status")).to_have_text("READY")
        assert link.commands.kind_of(link.commands.done) is Kind.RESET
        path = wait_for(lambda: _whole(bench.recordings))
    return Journey(alight.Recording.load(path), path, tick, began, pictures)


def _whole(folder: Path) -> Path | None:
    for path in folder.glob("*.mcap"):
        if alight.Recording.load(path).verdict.outcome is alight.Outcome.STOPPED:
            return path
    return None


def main() -> None:
    """Save the picture that the documentation shows."""
    with tempfile.TemporaryDirectory() as folder:
        made = journey(Path(folder)).pictures["draft"]
    with Image.open(io.BytesIO(made)) as full, whole_file(sys.argv[1]) as file:
        flat = full.convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE)
        flat.save(file, "png", optimize=True)


if __name__ == "__main__":
    main()
