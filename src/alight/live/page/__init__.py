"""The page: what happens on the bench, in the browser, and what may be changed there."""

from __future__ import annotations

from pathlib import Path


def serve_replay(path: Path, port: int) -> None:
    """Show a recording on the page, on this machine, until interrupted.

    Parameters
    ----------
    path : Path
        The recording.
    port : int
        Port of the page; 0 for a free one, which is printed.

    Raises
    ------
    AlightError
        If the file is no recording, or the port is taken.
    """
    from alight.live.page.replay import serve_replay as serve  # NiceGUI, for who shows a page only

    serve(path, port)
