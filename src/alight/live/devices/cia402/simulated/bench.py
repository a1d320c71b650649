"""The simulated bench: nodes on their buses, and the plant that their torques move."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from alight.kernels.select import Backend
from alight.live.devices.cia402.config import DrivesSettings, DriveTransducer
from alight.live.devices.cia402.network import Networks, PolledNetwork
from alight.live.devices.cia402.objects import (
    ENCODERS_PROFILE,
    SYNC,
    Dictionary,
    communication,
    drive_objects,
)
from alight.live.devices.cia402.scales import AngleScale, LengthScale, TorqueScale
from alight.live.devices.cia402.simulated.drive import SimulatedDrive
from alight.live.devices.cia402.simulated.node import SimulatedNode
from alight.live.devices.cia402.states import State
from alight.live.devices.simulated import SimulatedTestbed
from alight.scenarios import Scenario

INCREMENTS = 614400.0
"""Increments in a turn where the configuration leaves them to the drive."""
LAG = 0.5
"""Longest time [s] that one bus waits for the SYNC of another."""
ROUNDS = 16
"""Messages taken from a bus between two looks at heartbeats and watchdogs."""
OFF = (State.SWITCH_ON_DISABLED, State.NOT_READY)

Tell = Callable[[dict[str, Any]], None]


class SimulatedBench:
    """Both drives, the transducer and the plant, served by one loop.

    With each SYNC the plant moves on by one sample under the torques that were in force, then the
    nodes sample it and act on what they were sent. While both drives are off the plant stands, and
    when one is switched on it begins at the start of the scenario: somebody has put it back.
    Without SYNC no time passes for the plant.

    Parameters
    ----------
    settings : DrivesSettings
        The same configuration that the bench's host reads.
    scenario : Scenario
        Gives the plant and its sensors. A delay of its testbed is left out: it stands for that of
        the buses, which is here already.
    seed : int
        Seed of the sensor noise.
    tell : callable, optional
        Told of each change of a drive, as plain data.
    backend : {"auto", "vm", "c"}
        See `alight.kernels.stepper.Stepper`.

    Raises
    ------
    DeviceLost
        If a bus cannot be opened.
    """

    def __init__(
        self,
        settings: DrivesSettings,
        scenario: Scenario,
        seed: int = 0,
        tell: Tell | None = None,
        backend: Backend = "auto",
    ) -> None:
        loop = scenario.closed_loop
        prompt = dataclasses.replace(loop.testbed, delay=False)
        loop = dataclasses.replace(loop, testbed=prompt)
        self.plant = SimulatedTestbed(loop, scenario.start, seed, backend)
        self._settings = settings
        self._tell_of = tell or (lambda change: None)
        self._moves = False
        self._reading, self._torque = np.zeros(3), np.zeros(2)
        self.ticks = 0
        """How often the plant has moved on."""
        self.networks = Networks([PolledNetwork(n, bus) for n, bus in settings.bus.items()])
        self._synced: set[str] = set()
        self._since = 0.0
        for network in self.networks.all:
            network.subscribe(SYNC, self._on_sync(network.name))
        self.drives: tuple[SimulatedDrive, ...] = ()
        self._place({network.name: network for network in self.networks.all})
        self._sample()

    def _place(self, found: dict[str, PolledNetwork]) -> None:
        position = self._settings.position
        drives, self._angles, self._torques = [], [], []
        carrier: Dictionary | None = None
        for number, axis in enumerate(self._settings.axis, start=1):
            rated, increments = axis.rated_torque or 1.0, axis.increments or INCREMENTS
            objects = drive_objects()
            if isinstance(position, DriveTransducer) and position.axis == number:
                carrier = objects
            self._add_position(carrier if carrier is objects else None)
            self._angles.append(AngleScale(increments, axis.gear, axis.direction, axis.zero))
            self._torques.append(TorqueScale(rated, axis.gear, axis.direction))
            drives.append(
                SimulatedDrive(axis.node, found[axis.bus], objects, rated, increments, self._tell)
            )
        self.drives = tuple(drives)
        if isinstance(position, DriveTransducer):
            self.transducer: SimulatedNode = self.drives[position.axis - 1]
        else:
            objects = communication(ENCODERS_PROFILE)
            self._add_position(objects)
            self.transducer = SimulatedNode(position.node, found[position.bus], objects)
        self._length = LengthScale(position.scale, position.offset)

    def _add_position(self, objects: Dictionary | None) -> None:
        at = self._settings.position
        if objects is not None:
            objects.auxiliary(at.index, at.subindex, at.bits, signed=at.signed)

    @property
    def nodes(self) -> tuple[SimulatedNode, ...]:
        """Every node, each once."""
        return tuple(dict.fromkeys((*self.drives, self.transducer)))

    # The plant

    def _on_sync(self, name: str) -> Callable[[int, Any, float], None]:
        """What notes the SYNC of a bus.

        When all have come, all that was sent before them has been taken: then is the instant.
        """

        def note(can_id: int, data: Any, timestamp: float) -> None:
            if not self._synced:
                self._since = time.monotonic()
            self._synced.add(name)
            if len(self._synced) == len(self.networks.all):
                self._instant()

        return note

    def _instant(self) -> None:
        """Move the plant on; have the nodes sample it."""
        names = set(self._synced)
        self._synced.clear()
        self.ticks += 1
        self._move()
        for node in self.nodes:
            if node.network.name in names:
                node.sync()

    def _move(self) -> None:
        """Move the plant on by a sample, and read its sensors."""
        for number, (drive, scale) in enumerate(zip(self.drives, self._torques, strict=True)):
            self._torque[number] = scale.to_torque(drive.torque)
        self.plant.write(self._torque)
        self._sample()

    def _sample(self) -> None:
        self.plant.read(self._reading)
        for drive, scale, angle in zip(self.drives, self._angles, self._reading, strict=False):
            drive.position = scale.to_raw(float(angle))
        at, raw = self._settings.position, self._length.to_raw(float(self._reading[2]))
        self.transducer.put(at.index, raw, at.subindex)

    def _tell(self, drive: SimulatedDrive, cause: str) -> None:
        """Tell of a change, and let the plant stand or begin."""
        self._tell_of(
            {
                "time": time.monotonic(),
                "node": drive.number,
                "bus": drive.network.name,
                "state": drive.state.words,
                "torque": drive.torque,
                "cause": cause,
            }
        )
        if drive.state is State.READY and all(d.state in (*OFF, State.READY) for d in self.drives):
            self.plant.reset()
            self._moves = False
        elif drive.state is State.ENABLED and not self._moves:
            self._moves = True
            self.plant.enable()
            self.plant.read(self._reading)  # that of one sample before

    # Service

    def serve(self, seconds: float = 0.0) -> None:
        """Deal with all that has arrived; wait for something no longer than ``seconds``."""
        if not self._receive() and seconds:
            self.networks.nap(seconds)
            self._receive()
        now = time.monotonic()
        for network in self.networks.all:
            network.send_due(now)
        for node in self.nodes:
            node.watch(now)

    def _receive(self) -> int:
        """Take one message from each bus in turn, and so on for a while.

        A bus whose SYNC has come waits for the others: all nodes shall see the same instant.
        """
        total = 0
        for _ in range(ROUNDS):
            count = sum(network.receive(1) for network in self._next())
            total += count
            if not count:
                break
        return total

    def _next(self) -> list[PolledNetwork]:
        if self._synced and time.monotonic() - self._since > LAG:  # one was lost, or a bus is dead
            self._instant()
        return [network for network in self.networks.all if network.name not in self._synced]

    def close(self) -> None:
        """Leave the buses."""
        self.networks.close()
