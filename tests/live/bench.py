"""A real bench for tests: its processes, started on a session of their own and always ended."""

from __future__ import annotations

import contextlib
import dataclasses
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import alight
from alight.live.bank import Bank, parameter_column
from alight.live.session import Link, Session, Settings
from alight.live.shared.commands import Answer, Kind
from alight.live.shared.status import State
from alight.live.supervisor import free_port
from tests.cli.command import environment

PATIENCE = 60.0
"""Time [s] after which something that does not happen never will; no verdict on speed."""
SUPERVISE = """
import dataclasses, sys
from alight.live.session import Session
from alight.live.supervisor import look_after
look_after(Session.open(sys.argv[1]), lambda line: print(line, file=sys.stderr, flush=True))
"""


@dataclasses.dataclass
class Bench:
    """A session and the processes that this test started for it, by the name of the part."""

    session: Session
    processes: dict[str, subprocess.Popen[bytes]]

    @property
    def settings(self) -> Settings:
        return self.session.settings

    @property
    def recordings(self) -> Path:
        return Path(self.settings.recordings)

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.settings.port}/"

    def link(self) -> Link:
        """Attach to the newest host, as soon as there is one."""
        return Link.wait(self.session, seconds=PATIENCE)

    def start(self, part: str) -> subprocess.Popen[bytes]:
        """Start ``python -m alight.live.<part>``."""
        command = [sys.executable, "-m", f"alight.live.{part}", str(self.session.folder)]
        self.processes[part] = subprocess.Popen(command, env=environment(), process_group=0)
        (self.session.folder / f"{part}.pid").write_text(str(self.processes[part].pid))
        return self.processes[part]

    def pid(self, part: str) -> int:
        """Process of a part, whoever started it."""
        return int((self.session.folder / f"{part}.pid").read_text())

    def kill(self, part: str) -> None:
        """Kill a part as a power cut would, and see it gone."""
        number = self.pid(part)
        os.kill(number, signal.SIGKILL)
        if part in self.processes:
            self.processes[part].wait()
        else:
            wait_for(lambda: not lives(number))


def lives(number: int) -> bool:
    """Whether there is such a process, and it has not ended."""
    try:
        os.kill(number, 0)
        state = Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"


def wait_for(what: Callable[[], Any], seconds: float = PATIENCE) -> Any:
    """What a function gives as soon as that is true."""
    until = time.monotonic() + seconds
    while not (found := what()):
        assert time.monotonic() < until, f"never happened: {what}"
        time.sleep(0.005)
    return found


def ask(link: Link, kind: Kind, *, law: int = 0, values: object = (), by: str = "test") -> Answer:
    """Submit a command, and wait for what becomes of it."""
    text = json.dumps({"by": by, "values": {}})
    number = link.commands.submit(kind, law=law, values=values, text=text)
    wait_for(lambda: link.commands.done >= number)
    return link.commands.answer(number)


def state_of(link: Link) -> State:
    return State(int(link.status["state"]))


def columns(link: Link, name: str) -> slice:
    """Where a signal stands in a row."""
    return link.layout.slices()[name]


def gather(link: Link, first: int, count: int) -> np.ndarray:
    """``count`` rows of the ring from number ``first`` on, as soon as they are there."""
    wait_for(lambda: link.ring.head >= first + count)
    at, rows = link.ring.read(first, count)
    assert at == first
    return rows


def with_value(scenario: alight.Scenario, law: int = 0, **values: Any) -> np.ndarray:
    """Parameters of a law of a scenario's bank with some of ``law.gains`` changed."""
    loop = Bank.of(scenario).loops[law]
    gains = dataclasses.replace(loop.law.gains, **values)
    changed = dataclasses.replace(loop.law, gains=gains)
    return parameter_column(dataclasses.replace(loop, law=changed))


@contextlib.contextmanager
def session_for(
    folder: Path, scenario: str = "experiment-1", overrides: Sequence[str] = (), **settings: Any
) -> Iterator[Session]:
    """A session without processes; recordings go to ``folder``."""
    chosen = alight.load_scenario(scenario, overrides)
    given = {"seed": chosen.document.seed, "budget": 10**9, **settings}
    made = Session.create(Settings(chosen.description(), str(folder / "recordings"), **given))
    (folder / "recordings").mkdir(exist_ok=True)
    try:
        yield made
    finally:
        made.remove()


@contextlib.contextmanager
def bench(
    folder: Path,
    scenario: str = "experiment-1",
    overrides: Sequence[str] = (),
    parts: Sequence[str] = ("host",),
    **settings: Any,
) -> Iterator[Bench]:
    """Processes of a bench, each started by itself, without a supervisor.

    The budget of missed deadlines is without end unless given: the machine of a test is loaded.
    """
    given = {"port": free_port("127.0.0.1", 0), **settings}
    with session_for(folder, scenario, overrides, **given) as session:
        made = Bench(session, {})
        try:
            for part in parts:
                made.start(part)
            yield made
        finally:
            _end(made.processes.values())


@contextlib.contextmanager
def supervised(
    folder: Path, scenario: str = "experiment-1", overrides: Sequence[str] = (), **settings: Any
) -> Iterator[Bench]:
    """A whole bench under its supervisor: ``processes["supervisor"]``, the others by `Bench.pid`.

    Every process of it is gone afterwards, whatever was killed in between.
    """
    given = {"port": free_port("127.0.0.1", 0), **settings}
    with session_for(folder, scenario, overrides, **given) as session:
        command = [sys.executable, "-c", SUPERVISE, str(session.folder)]
        process = subprocess.Popen(command, env=environment(), process_group=0)
        made = Bench(session, {"supervisor": process})
        seen: dict[str, int] = {}
        try:
            wait_for(lambda: session.hosts)
            yield made
        finally:
            for part in ("host", "record", "page"):
                with contextlib.suppress(OSError, ValueError):
                    seen[part] = made.pid(part)
            _end(made.processes.values())
            for number in seen.values():
                with contextlib.suppress(ProcessLookupError):
                    os.kill(number, signal.SIGKILL)


def _end(processes: Iterator[subprocess.Popen[bytes]] | Any) -> None:
    """Ask processes to end, and end those that do not."""
    for process in processes:
        process.terminate()
    for process in processes:
        try:
            process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
