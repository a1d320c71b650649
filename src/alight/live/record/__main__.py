"""The process that records: ``python -m alight.live.record SESSION_FOLDER``."""

from __future__ import annotations

import functools
import os
import signal
import sys
import time
from pathlib import Path

from alight.live.bank import Bank
from alight.live.record.place import read_place
from alight.live.record.recorder import POLL, Recorder
from alight.live.session import Link, Session

SILENT = 0.5
"""After this time [s] without a sign of life it is looked whether the host's process is there."""


class Follower:
    """Records one host after the other, until it is told to end or nobody is left."""

    def __init__(self, folder: str) -> None:
        self._session = Session.open(folder)
        self._parent = os.getppid()
        self._wanted = True
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        signal.signal(signal.SIGTERM, self._on_end)

    def _on_end(self, *_: object) -> None:
        self._wanted = False

    def run(self) -> None:
        """Follow the host of the recorder before this one to its end, then those after it."""
        bank = Bank.of(self._session.scenario)
        place = read_place(self._session.folder)
        done = "" if place is None else _before(self._session.hosts, place.host)
        while self._wanted and not self._nobody_left(done):
            following = [host for host in self._session.hosts if _number(host.name) > _number(done)]
            if not following:
                time.sleep(POLL)
                continue
            host = following[0]
            link = Link.open(host)
            here = place if place is not None and place.host == host.name else None
            recorder = Recorder(self._session, link, bank, here)
            recorder.follow(lambda: self._wanted, functools.partial(self._is_alive, link))
            done = host.name

    def _is_alive(self, link: Link) -> bool:
        """Whether a host lives, and is the newest."""
        if self._session.hosts[-1:] != [link.folder]:
            return False
        silent = time.monotonic() - float(link.status["alive"])
        return silent < SILENT or is_running(int(link.status["pid"]))

    def _nobody_left(self, done: str) -> bool:
        """Whether the supervisor is gone, and every host."""
        orphan = os.getppid() != self._parent
        return orphan and all(_number(h.name) <= _number(done) for h in self._session.hosts)


def is_running(pid: int) -> bool:
    """Whether a process is there, and has not ended."""
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    status = Path(f"/proc/{pid}/stat")
    # One that has ended stays until its parent has taken note: in state Z.
    try:
        return status.read_text().rpartition(")")[2].split()[:1] != ["Z"]
    except OSError:
        return not Path("/proc/self").exists()


def _number(name: str) -> int:
    return int(name.partition("-")[2] or 0)


def _before(hosts: list[Path], name: str) -> str:
    """Name of the host before one, empty if there is none."""
    earlier = [host.name for host in hosts if _number(host.name) < _number(name)]
    return earlier[-1] if earlier else ""


if __name__ == "__main__":
    Follower(sys.argv[1]).run()
