"""Drives and the simulated bench on virtual buses of one process."""

from __future__ import annotations

import contextlib
import copy
import itertools
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

import alight
from alight.live.devices import DeviceLost
from alight.live.devices.cia402 import Drives
from alight.live.devices.cia402.config import DrivesSettings, drives_from
from alight.live.devices.cia402.simulated import SimulatedBench
from alight.live.devices.cia402.simulated.node import SimulatedNode

PATIENCE = 60.0
"""Time [s] after which something that does not happen never will."""
RESOLUTION = 1.00033065276e-06
NOISELESS = {"testbed.transducer.noise": 0.0}
_numbers = itertools.count()


def content(**timing: Any) -> dict[str, Any]:
    """A configuration as a file holds it; three virtual buses that no other test uses."""
    number = next(_numbers)
    bus = {n: {"interface": "virtual", "channel": f"{n} {number}"} for n in ("s", "e", "t")}
    return {
        "bus": bus,
        "axis": [
            {"node": 1, "bus": "s", "rated_torque": 240.0, "increments": 614400},
            {"node": 2, "bus": "e", "rated_torque": 20.0, "increments": 614400},
        ],
        "position": {"type": "transducer", "node": 3, "bus": "t", "scale": RESOLUTION},
        "timing": {"heartbeat": 0.05, "watchdog": 5.0, "answer": 2.0, **timing},
    }


def changed(given: dict[str, Any], *path: Any, value: Any) -> dict[str, Any]:
    """The same configuration with one value replaced."""
    made = copy.deepcopy(given)
    at: Any = made
    for key in path[:-1]:
        at = at[key]
    at[path[-1]] = value
    return made


class Rig:
    """A simulated bench, and the drives that are opened on it."""

    def __init__(self, settings: DrivesSettings, scenario: alight.Scenario) -> None:
        self.settings, self.scenario = settings, scenario
        self.changes: list[dict[str, Any]] = []
        self.bench = SimulatedBench(settings, scenario, tell=self.changes.append, backend="vm")
        self.drives: Drives
        self.reading = np.zeros(3)

    @contextlib.contextmanager
    def served(self) -> Iterator[None]:
        """Have the bench answer by itself, for calls that wait for it."""
        ended = threading.Event()

        def serve() -> None:
            while not ended.is_set():
                self.bench.serve(0.001)

        thread = threading.Thread(target=serve)
        thread.start()
        try:
            yield
        finally:
            ended.set()
            thread.join()

    def open(self) -> None:
        with self.served():
            self.drives = Drives(self.settings, self.scenario, backend="vm")

    def enable(self) -> None:
        with self.served():
            self.drives.enable()

    def reset(self) -> None:
        with self.served():
            self.drives.reset()

    def tick(self, *torque: float) -> np.ndarray:
        """A tick of the host, and the bench's answer to it."""
        self.drives.read(self.reading)
        self.drives.write(np.array(torque or (0.0, 0.0)))
        self.bench.serve()
        return self.reading.copy()

    def until_lost(self, *torque: float) -> str:
        """Tick until the device is lost; why it was."""
        until = time.monotonic() + PATIENCE
        while time.monotonic() < until:
            try:
                self.tick(*torque)
            except DeviceLost as error:
                return str(error)
        raise AssertionError("the device was never lost")

    def serve_until(self, what: Callable[[], Any]) -> None:
        """Serve the bench alone until something is so."""
        until = time.monotonic() + PATIENCE
        while not what():
            assert time.monotonic() < until, "never happened"
            self.bench.serve(0.001)

    def states(self) -> list[str]:
        return [drive.state.words for drive in self.bench.drives]

    def torques(self) -> list[int]:
        return [drive.torque for drive in self.bench.drives]

    def node(self, number: int) -> SimulatedNode:
        return next(node for node in self.bench.nodes if node.number == number)


def scenario(**values: Any) -> alight.Scenario:
    return alight.load_scenario("experiment-1", {**NOISELESS, **values})


@contextlib.contextmanager
def rig(given: dict[str, Any] | None = None, *, opened: bool = True) -> Iterator[Rig]:
    """A rig with its drives open, unless they shall not be."""
    settings = drives_from(content() if given is None else given, "drives.toml")
    made = Rig(settings, scenario())
    try:
        if opened:
            made.open()
        yield made
    finally:
        with made.served():
            if hasattr(made, "drives"):
                made.drives.close()
        made.bench.close()
