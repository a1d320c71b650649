"""The progress bar: not at once, not in a file, and with percentage and time remaining."""

from __future__ import annotations

import time

from alight.cli import progress
from alight.cli.progress import progress_bar


class Screen:
    """A terminal that keeps what is written to it."""

    def __init__(self, terminal: bool = True) -> None:
        self.text = ""
        self._terminal = terminal

    def isatty(self) -> bool:
        return self._terminal

    def write(self, text: str) -> int:
        self.text += text
        return len(text)

    def flush(self) -> None:
        pass


def shown(monkeypatch, screen: Screen, patience: float, seconds: float) -> str:
    """What a task of some length puts on a screen."""
    monkeypatch.setattr("sys.stderr", screen)
    monkeypatch.setattr(progress, "PATIENCE", patience)
    for name, value in (("TERM", "xterm"), ("COLUMNS", "90")):
        monkeypatch.setenv(name, value)
    for name in ("NO_COLOR", "FORCE_COLOR", "TTY_COMPATIBLE", "TTY_INTERACTIVE"):
        monkeypatch.delenv(name, raising=False)
    with progress_bar("baking") as report:
        for step in range(1, 5):
            time.sleep(seconds / 4)
            report(step / 4, "cooling" if step == 4 else None)
        time.sleep(0.3)
    return screen.text


def test_a_short_task_shows_nothing(monkeypatch):
    assert shown(monkeypatch, Screen(), patience=60.0, seconds=0.01) == ""


def test_a_long_task_shows_what_it_does_how_far_it_is_and_how_long_it_takes(monkeypatch):
    text = shown(monkeypatch, Screen(), patience=0.05, seconds=1.0)
    for part in ("baking", "cooling", "25%", "50%", "100%", "0:00:00"):
        assert part in text


def test_two_seconds_are_the_limit():
    assert progress.PATIENCE == 2.0


def test_nothing_is_shown_where_there_is_no_terminal(monkeypatch):
    assert shown(monkeypatch, Screen(terminal=False), patience=0.0, seconds=0.2) == ""
