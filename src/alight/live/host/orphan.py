"""Whether a host whose supervisor was killed has anybody left to serve."""

from __future__ import annotations

import os
import time
from pathlib import Path

PATIENCE = 30.0
"""Time [s] for which an orphan waits for somebody."""


class Orphan:
    """Asked now and then whether there is no reason to go on.

    A host goes on as long as its supervisor lives, a run is on, or a page is alive.

    Parameters
    ----------
    folder : Path
        That of the session; ``page.pid`` in it says which process is the page.
    """

    def __init__(self, folder: Path) -> None:
        self._page, self._parent = folder / "page.pid", os.getppid()
        self._alone_since: float | None = None

    def __call__(self, running: bool) -> bool:
        """Whether to end, given whether a run is on."""
        if running or os.getppid() == self._parent or self._page_lives():
            self._alone_since = None
            return False
        now = time.monotonic()
        if self._alone_since is None:
            self._alone_since = now
        return now - self._alone_since > PATIENCE

    def _page_lives(self) -> bool:
        try:
            os.kill(int(self._page.read_text()), 0)
        except (OSError, ValueError, OverflowError):
            return False
        return True
