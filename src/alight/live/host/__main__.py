"""``python -m alight.live.host SESSION_FOLDER``: the host of a bench."""

from __future__ import annotations

import signal
import sys
import time
from pathlib import Path
from types import FrameType

import numpy as np

from alight.errors import AlightError
from alight.live.bank import Bank, parameter_column
from alight.live.cycle import Cycle
from alight.live.devices import Device
from alight.live.devices.simulated import SimulatedTestbed
from alight.live.host.loop import Loop
from alight.live.host.orphan import Orphan
from alight.live.host.realtime import prepare, spin
from alight.live.session import Link, Session
from alight.live.shared.commands import Command, CommandBox, Kind
from alight.live.shared.ring import TelemetryRing
from alight.live.shared.status import TEXT, create_status
from alight.scenarios import Scenario

KEPT = 30.0
"""Time [s] of telemetry that the ring keeps: 32 MB at 2 kHz; a container may have 64."""
WARM = 100
"""Ticks of each law before the first that counts."""
FAILED = 2


def main(folder: str) -> int:
    """Run the host of a session to its end.

    Returns
    -------
    int
        Exit code: 0, or 2 if the device could not be opened or the scenario cannot run live.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the supervisor's
    try:
        session = Session.open(folder)
        scenario = session.scenario
        device = _open(session, scenario)
    except AlightError as error:
        print(f"error: {error}", file=sys.stderr)
        return FAILED
    try:
        _serve(session, scenario, device)
    except AlightError as error:
        print(f"error: {error}", file=sys.stderr)
        return FAILED
    finally:
        device.close()
    return 0


def _open(session: Session, scenario: Scenario) -> Device:
    settings = session.settings
    if settings.device is None:
        return SimulatedTestbed(scenario.closed_loop, scenario.start, settings.seed)
    from alight.live.devices.cia402 import open_drives

    return open_drives(Path(settings.device), scenario)


def _serve(session: Session, scenario: Scenario, device: Device) -> None:
    bank, period = Bank.of(scenario), 1 / scenario.testbed.sample_rate
    cycle = Cycle(bank, device)
    link = _share(session, cycle, scenario.testbed.sample_rate)
    _warm(cycle, bank, period)
    lines = prepare(session.settings.core)
    link.status["scheduling"] = "\n".join(lines).encode()[: 4 * TEXT]
    loop = Loop(cycle, link, session.settings, period, spin())

    def end(_: int, __: FrameType | None) -> None:
        loop.ended = True

    signal.signal(signal.SIGTERM, end)
    link.announce()
    loop.run(Orphan(session.folder))


def _share(session: Session, cycle: Cycle, rate: float) -> Link:
    """Make what this host shares, in a folder of its own."""
    home, width = session.next_host(), cycle.layout.size
    ring = TelemetryRing.create(home / "ring", width, max(int(KEPT * rate), 1))
    commands = CommandBox.create(home / "commands")
    return Link(home, cycle.layout, ring, commands, create_status(home / "status"))


def _warm(cycle: Cycle, bank: Bank, period: float) -> None:
    """Tick with every law while nobody watches: no deadline pays for what is used the first time.

    At the pace of the device, which may be a bus.
    """
    row = np.empty(cycle.layout.size)
    for number in (*range(1, len(bank.loops)), 0):
        cycle.apply(Command(0, Kind.LAW, number, parameter_column(bank.loops[number])))
        for _ in range(WARM):
            cycle.tick(row)
            time.sleep(period)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
