"""``python -m alight.live.page SESSION_FOLDER``: the page of a bench."""

from __future__ import annotations

import os
import signal
import sys

from alight.errors import AlightError
from alight.live.session import Session


def main(folder: str) -> int:
    """Serve the page of a session to its end."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the supervisor's
    try:
        session = Session.open(folder)
    except AlightError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    os.environ["NICEGUI_STORAGE_PATH"] = str(session.folder / "nicegui")
    from alight.live.page.live import serve_bench

    try:
        serve_bench(session)
    except AlightError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
