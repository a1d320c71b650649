"""The supervisor: starts the processes of a bench, replaces those that die, ends all in order."""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType

from alight.errors import AlightError
from alight.live.session import PREFIX, Link, Session, Settings, place_of_sessions

PATIENCE = {"host": 10.0, "record": 30.0, "page": 5.0}
"""How long each process may take to end when asked to [s]; the order is that of ending: the
recorder writes down what the host did last, and the page shows it."""
LOOK = 0.05
"""Time [s] between two looks at the processes."""
SHORT = 5.0
"""A process that ends sooner [s] is not started again before as much time has passed."""
READY = 120.0
"""Time [s] in which host and page must be ready; the first host of all compiles the laws."""

Say = Callable[[str], None]


class HostFailed(AlightError):
    """A host that ended before it was ready; it has said why."""


@dataclass
class Part:
    """A process of the bench."""

    name: str
    session: Session
    process: subprocess.Popen[bytes] | None = None
    began: float = 0.0

    def start(self) -> None:
        """Start it, in a group of its own: the terminal's Ctrl-C is the supervisor's."""
        command = [sys.executable, "-m", f"alight.live.{self.name}", str(self.session.folder)]
        self.process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=2, process_group=0
        )
        self.began = time.monotonic()
        (self.session.folder / f"{self.name}.pid").write_text(str(self.process.pid))

    @property
    def alive(self) -> bool:
        """Whether it runs."""
        return self.process is not None and self.process.poll() is None

    @property
    def ending(self) -> str:
        """How it ended, in words."""
        code = self.process.poll() if self.process is not None else None
        if code is None:
            return "runs"
        return f"was ended by {signal.Signals(-code).name}" if code < 0 else f"ended with {code}"

    def end(self, patience: float) -> None:
        """Ask it to end; after ``patience`` [s] end it."""
        if self.process is None:
            return
        self.process.terminate()
        try:
            self.process.wait(patience)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()


@dataclass
class Supervisor:
    """The processes of a session, looked after until `stop` is asked for.

    A recorder or page that dies is replaced. A dead host is not: that is for the operator, whose
    page asks for it with the file ``restart-host`` in the folder of the session.

    Parameters
    ----------
    session : Session
        What the processes share.
    say : callable
        Told in words what happens.
    """

    session: Session
    say: Say
    stopped: bool = False
    parts: dict[str, Part] = field(init=False)
    _told: bool = False

    def __post_init__(self) -> None:
        self.parts = {name: Part(name, self.session) for name in PATIENCE}

    def run(self) -> None:
        """Start everything, look after it until asked to stop, end everything, leave no trace.

        Raises
        ------
        HostFailed
            If the first host ends before it is ready.
        """
        (self.session.folder / "supervisor.pid").write_text(str(os.getpid()))
        try:
            for part in self.parts.values():
                part.start()
            if self._wait_for_host() and self._wait_for_page():
                self._greet()
            while not self.stopped:
                self._look()
                time.sleep(LOOK)
        finally:
            for name, part in self.parts.items():
                part.end(PATIENCE[name])
            self.session.remove()

    def _wait_for_host(self) -> bool:
        until = time.monotonic() + READY
        while not self.session.hosts and not self.stopped:
            if not self.parts["host"].alive or time.monotonic() > until:
                raise HostFailed(f"the host was never ready: it {self.parts['host'].ending}")
            time.sleep(LOOK)
        return not self.stopped

    def _wait_for_page(self) -> bool:
        settings, until = self.session.settings, time.monotonic() + READY
        while not self.stopped and time.monotonic() < until:
            with contextlib.suppress(OSError):
                socket.create_connection((reachable(settings.host), settings.port), 1.0).close()
                return True
            self._look()
            time.sleep(LOOK)
        return False

    def _greet(self) -> None:
        settings, link = self.session.settings, Link.open(self.session.hosts[-1])
        self.say(f"page        {address_of(settings)}")
        self.say(f"recordings  {os.path.abspath(settings.recordings)}")
        for line in link.status["scheduling"].decode().splitlines():
            self.say(f"host        {line}")
        self.say("Ctrl-C ends the bench")

    def _look(self) -> None:
        """Replace what died and may be replaced."""
        for name in ("record", "page"):
            part = self.parts[name]
            if not part.alive and time.monotonic() - part.began > SHORT:
                self.say(f"the {name} process {part.ending}; another one takes over")
                part.start()
        host = self.parts["host"]
        if not host.alive and not self._told:
            self.say(f"the host {host.ending}; the page can start another one")
            self._told = True
        with contextlib.suppress(FileNotFoundError):
            (self.session.folder / "restart-host").unlink()
            host.end(0.0)
            host.start()
            self._told = False


def reachable(host: str) -> str:
    """An address under which this machine reaches a server that listens on ``host``."""
    return {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(host, host)


def address_of(settings: Settings) -> str:
    """Where the page is, for a browser."""
    everywhere = settings.host in ("0.0.0.0", "::")
    host = socket.gethostname() if everywhere else settings.host
    shown = f"[{host}]" if ":" in host else host
    token = f"?token={settings.token}" if settings.token else ""
    return f"http://{shown}:{settings.port}/{token}"


def free_port(host: str, port: int) -> int:
    """A port on which the page can listen: the given one, or any free one for 0.

    Raises
    ------
    AlightError
        If it cannot listen there.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.socket(family, socket.SOCK_STREAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, port))
            return int(probe.getsockname()[1])
        except (OSError, OverflowError) as error:
            reason = error.strerror if isinstance(error, OSError) else str(error)
            raise AlightError(
                f"the page cannot listen on {host}, port {port}: {reason}; take another --port"
            ) from None


@contextlib.contextmanager
def apart_from(core: int | None) -> Iterator[None]:
    """Keep this process, and those that it starts, off the core of the host."""
    if core is None:
        yield
        return
    before = os.sched_getaffinity(0)
    others = before - {core}
    try:
        if others:
            os.sched_setaffinity(0, others)
        yield
    finally:
        os.sched_setaffinity(0, before)


def supervise(settings: Settings, say: Say) -> None:
    """Run a bench until Ctrl-C, SIGTERM or SIGHUP.

    Raises
    ------
    AlightError
        If the host could not begin.
    """
    sweep(place_of_sessions())
    look_after(Session.create(settings), say)


def sweep(place: Path) -> None:
    """Remove the folders of benches of which every process was killed."""
    for number in place.glob(f"{PREFIX}*/supervisor.pid"):
        if not any(_lives(path) for path in number.parent.glob("*.pid")):
            shutil.rmtree(number.parent, ignore_errors=True)


def _lives(number: Path) -> bool:
    """Whether the process of a file with its number may be there."""
    try:
        os.kill(int(number.read_text()), 0)
    except (ProcessLookupError, ValueError, FileNotFoundError):
        return False
    except OSError:  # it is there, and somebody else's
        return True
    return True


def look_after(session: Session, say: Say) -> None:
    """Run the bench of a session; see `supervise`."""
    bench = Supervisor(session, say)

    def stop(_: int, __: FrameType | None) -> None:
        bench.stopped = True

    wanted = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    before = {number: signal.signal(number, stop) for number in wanted}
    try:
        with apart_from(session.settings.core):
            bench.run()
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
