"""A tick of the live bench as it is built up, from law and plant to the row in a file."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from itertools import repeat
from pathlib import Path
from typing import Any

import numpy as np

from alight import Scenario
from alight.live.bank import Bank
from alight.live.cycle import Cycle
from alight.live.devices.simulated import SimulatedTestbed
from alight.live.host.loop import Loop
from alight.live.record.run_file import RunFile
from alight.live.session import Link, Settings
from alight.live.shared.commands import Command, CommandBox, Kind
from alight.live.shared.ring import TelemetryRing
from alight.live.shared.status import create_status
from alight.simulation import Controller
from alight.simulation.recording_description import Description
from alight.simulation.verdict import Outcome, Verdict
from alight.symbolic.signals import Layout
from alight_benchmarks.own.bench import Bench
from alight_benchmarks.own.problems import full
from alight_benchmarks.own.ratios import Work, compared

ROWS = 4096
"""In the ring."""
BATCH = 500
"""Rows that the recorder takes and forces to the disk at once: a quarter of a second."""
NO_TIME = 1e-9
"""A period [s] that is over before the tick begins, so that the host never waits."""


def measure(bench: Bench) -> dict[str, Any]:
    """Time of a tick with more and more of what host and recorder do, over that of the bare one."""
    n, rows = bench.pace.ticks_of_law // 20, []
    with tempfile.TemporaryDirectory() as folder:
        named = dict(_ways(full(), Path(folder), n))
        bare = next(iter(named.values()))
        for name, work in named.items():
            bench.report(len(rows) / len(named), f"live: {name}")
            found = compared(work, bare, bench.pace)
            tick = found["seconds"]["median"] / n
            rows.append({"way": name, "ratio": found["ratio"], "tick": tick})
    return {"rows": rows, "sample_rate": full().testbed.sample_rate}


def _ways(scenario: Scenario, folder: Path, n: int) -> Iterator[tuple[str, Work]]:
    device = SimulatedTestbed(scenario.closed_loop, scenario.start, 0, backend="c")
    yield "bare: read, law, write, compiled", Work(_bare(scenario, device, n), n)
    cycle = Cycle(Bank.of(scenario), device, backend="c")
    row = np.zeros(cycle.layout.size)
    yield (
        "with its row, its checks, V_r and kicks",
        Work(_run(cycle, lambda: cycle.tick(row), n), n),
    )
    ring = TelemetryRing.create(folder / "ring", cycle.layout.size, ROWS)
    status, box = create_status(folder / "status"), CommandBox.create(folder / "commands")
    link = Link(folder, cycle.layout, ring, box, status)
    settings = Settings(scenario.description(), str(folder), budget=10**15)
    loop = Loop(cycle, link, settings, NO_TIME)
    yield "with clock, status, commands and telemetry: the host", Work(_run(cycle, loop.tick, n), n)
    yield "the recorder, for a tick", Work(_recorder(folder, cycle, n), n)


def _bare(scenario: Scenario, device: SimulatedTestbed, n: int) -> Callable[[], None]:
    controller = Controller(scenario, backend="c")
    reading, torque, step = controller.reading, controller.torque, controller.step

    def call() -> None:
        device.reset()
        device.enable()
        controller.reset()
        for _ in repeat(None, n):
            device.read(reading)
            step()
            device.write(torque)

    return call


def _run(cycle: Cycle, tick: Callable[[], Any], n: int) -> Callable[[], None]:
    commands = [Command(0, kind, 0, np.zeros(0)) for kind in (Kind.STOP, Kind.RESET, Kind.START)]

    def call() -> None:
        for command in commands:
            cycle.apply(command)
        for _ in repeat(None, n):
            tick()

    return call


def _recorder(folder: Path, cycle: Cycle, n: int) -> Callable[[], None]:
    rows = np.zeros((BATCH, cycle.layout.size))
    _run(cycle, lambda: None, 0)()
    for row in rows:
        cycle.tick(row)
    unknown = Verdict(Outcome.CUT_OFF, 0.0)
    signals = {name: s for name, s in cycle.layout.signals.items() if name != "t"}
    description = Description(None, Layout(signals), unknown, scenario={})

    def call() -> None:
        file = RunFile(folder / "recording.mcap", description)
        for first in range(0, n, BATCH):
            file.write(rows[: n - first], first, [])
            file.save()
        file.leave()
        file.path.unlink()

    return call
