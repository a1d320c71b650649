"""Host and drives in processes of their own, on a virtual bus between them."""

from __future__ import annotations

import contextlib
import json
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import can
import numpy as np
import pytest
import tomlkit

from alight.live.shared.commands import Kind, Outcome
from alight.live.shared.status import State
from tests.cli.command import environment
from tests.live.bench import PATIENCE, Bench, ask, bench, columns, gather, state_of, wait_for
from tests.live.drives.rig import content

GROUP = "239.74.163.2"


def _reaches_itself() -> bool:
    """Whether this machine hands multicast messages on to its own processes."""
    options: dict[str, Any] = {"port": _free_ports(1)[0], "hop_limit": 0, "fd": False}
    try:
        with can.Bus(interface="udp_multicast", channel=GROUP, **options) as bus:
            bus.send(can.Message(arbitration_id=1, is_extended_id=False))
            return bus.recv(1.0) is not None
    except (can.CanError, OSError):
        return False


def _free_ports(count: int) -> list[int]:
    with contextlib.ExitStack() as opened:
        sockets = [
            opened.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
            for _ in range(count)
        ]
        for one in sockets:
            one.bind(("127.0.0.1", 0))
        return [one.getsockname()[1] for one in sockets]


pytestmark = pytest.mark.skipif(
    not _reaches_itself(), reason="no multicast within this machine: there is no route for it"
)


class Simulated:
    """``python -m alight.live.devices.cia402.simulated``, what it says, and what it is told."""

    def __init__(self, config: Path) -> None:
        command = [sys.executable, "-m", "alight.live.devices.cia402.simulated"]
        self.process = subprocess.Popen(
            [*command, str(config), "experiment-1"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=environment(),
            text=True,
            bufsize=1,
        )
        self.said: list[dict[str, Any]] = []
        self._listener = threading.Thread(target=self._listen)
        self._listener.start()
        self.until(lambda said: said.get("ready"))

    def _listen(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.said.append(json.loads(line))

    def until(self, what: Callable[[dict[str, Any]], Any], since: int = 0) -> dict[str, Any]:
        """What was said first, from a line on, of which something is so."""
        found = wait_for(lambda: [said for said in self.said[since:] if what(said)])
        return dict(found[0])

    def tell(self, order: str) -> int:
        """Give an order; how much had been said before."""
        before = len(self.said)
        assert self.process.stdin is not None
        self.process.stdin.write(f"{order}\n")
        self.process.stdin.flush()
        return before

    def end(self) -> None:
        self.process.terminate()
        self.process.wait(PATIENCE)
        self._listener.join()
        for pipe in (self.process.stdin, self.process.stdout):
            assert pipe is not None
            pipe.close()


@pytest.fixture
def config(tmp_path: Path) -> Path:
    given = content(exchange="fresh", fresh_wait=2000.0, watchdog=2.0, answer=5.0)
    for bus, port in zip(given["bus"].values(), _free_ports(3), strict=True):
        options = {"port": port, "hop_limit": 0, "fd": False}
        bus |= {"interface": "udp_multicast", "channel": GROUP, "options": options}
    path = tmp_path / "drives.toml"
    path.write_text(tomlkit.dumps(given))
    return path


@pytest.fixture
def simulated(config: Path) -> Iterator[Simulated]:
    made = Simulated(config)
    try:
        yield made
    finally:
        made.end()


@pytest.fixture
def live(config: Path, simulated: Simulated, tmp_path: Path) -> Iterator[Bench]:
    """A host on those drives."""
    with bench(tmp_path, device=str(config)) as made:
        yield made


def is_fault(number: int) -> Callable[[dict[str, Any]], bool]:
    return lambda said: said.get("node") == number and said["state"] == "Fault"


@pytest.mark.slow
def test_a_run_strikes_and_a_pulled_plug_ends_it(live: Bench, simulated: Simulated) -> None:
    link = live.link()
    answer = ask(link, Kind.START)
    assert answer.outcome is Outcome.APPLIED, answer.reason
    rows = gather(link, answer.tick, 600)
    assert rows[:, columns(link, "Lambda")].max() == 1.0
    assert rows[:, columns(link, "F_m")].max() > 10.0
    assert (rows[5:, columns(link, "statusword")].astype(int) & 0x6F == 0x27).all()
    since = simulated.tell("unplug 2")
    wait_for(lambda: state_of(link) is State.TRIPPED)
    # Which of both is missed first is a matter of their times.
    reason = bytes(link.status["reason"])
    assert reason.startswith(b"axis 2 (node 2 on bus e): no ")
    assert b"measurement" in reason or b"heartbeat" in reason
    safe = simulated.until(
        lambda said: said.get("node") == 1 and said["state"] == "Switch on disabled", since
    )
    assert safe["torque"] == 0
    assert simulated.until(is_fault(2), since)["torque"] == 0  # its own watchdog
    after = gather(link, link.ring.head, 5)
    assert not after[:, columns(link, "torque")].any()

    since = simulated.tell("plug 2")
    simulated.until(lambda said: said.get("cause") == "boot-up", since)
    assert ask(link, Kind.RESET).outcome is Outcome.APPLIED
    answer = ask(link, Kind.START)
    assert answer.outcome is Outcome.APPLIED, answer.reason
    again = gather(link, answer.tick, 300)
    np.testing.assert_allclose(
        again[:, columns(link, "q")], rows[:300, columns(link, "q")], rtol=0, atol=1e-5
    )


@pytest.mark.slow
def test_drives_are_safe_by_their_watchdog_when_the_host_is_killed(
    live: Bench, simulated: Simulated
) -> None:
    link = live.link()
    answer = ask(link, Kind.START)
    assert answer.outcome is Outcome.APPLIED, answer.reason
    gather(link, answer.tick, 50)
    since = len(simulated.said)
    live.kill("host")
    for number in (1, 2):
        said = simulated.until(is_fault(number), since)
        assert said["torque"] == 0
        assert "0x8130" in said["cause"] or "0x8250" in said["cause"]
    live.start("host")
    link = wait_for(lambda: len(live.session.hosts) > 1) and live.link()
    refused = ask(link, Kind.START)
    assert refused.outcome is Outcome.REFUSED and "is in a fault" in refused.reason
    assert ask(link, Kind.RESET).outcome is Outcome.APPLIED
    answer = ask(link, Kind.START)
    assert answer.outcome is Outcome.APPLIED, answer.reason


@pytest.mark.slow
def test_a_bad_file_is_refused_by_the_simulated_bench(tmp_path: Path) -> None:
    (tmp_path / "bad.toml").write_text("node = 300")
    command = [sys.executable, "-m", "alight.live.devices.cia402.simulated"]
    done = subprocess.run(
        [*command, str(tmp_path / "bad.toml"), "experiment-1"],
        env=environment(),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert "bad.toml" in done.stderr and "node = 300" in done.stderr
