"""CANopen without threads: a network that is served by whoever calls it, and only then.

A heartbeat that a thread sends would go on when the loop hangs. Here all that leaves or arrives
does so within a call: a loop that stands still falls silent on the bus.
"""

from __future__ import annotations

import contextlib
import select
import time
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import can
from canopen import Network, ObjectDictionary, RemoteNode
from canopen.sdo.client import SdoClient

from alight.live.devices.cia402.config import BusSettings
from alight.live.devices.device import DeviceLost

MOST_AT_ONCE = 64
"""Frames taken from a bus in one go: a babbling node does not hold up the loop."""
BUS_OFF = 0x40
"""Class of an error frame: the controller has left the bus."""
NAP = 5e-5
"""Wait [s] between two looks at buses that cannot be waited for."""


def open_bus(name: str, settings: BusSettings) -> can.BusABC:
    """Open a CAN bus.

    Raises
    ------
    DeviceLost
        If python-can cannot open it.
    """
    try:
        return can.Bus(
            interface=settings.interface,
            channel=settings.channel,
            bitrate=settings.bitrate,
            **settings.options,
        )
    # What the drivers of interfaces raise is as various as they are.
    except Exception as error:
        raise DeviceLost(
            f"bus {name}: {settings.interface} {settings.channel} cannot be opened: {error}"
        ) from error


class Task:
    """A message that is due again and again, sent by `PolledNetwork.send_due`."""

    def __init__(self, network: PolledNetwork, can_id: int, data: Iterable[int], period: float):
        self.message = can.Message(arbitration_id=can_id, data=data, is_extended_id=False)
        self.period = period
        self.due = time.monotonic()
        self._network = network

    def stop(self) -> None:
        """Send it no more."""
        with contextlib.suppress(ValueError):
            self._network.tasks.remove(self)

    def update(self, data: Iterable[int]) -> None:
        """Change what it says."""
        self.message.data = bytearray(data)


class PolledNetwork(Network):
    """A `canopen.Network` that has no thread: it sends and receives when it is told to.

    Parameters
    ----------
    name : str
        Of the bus, for messages.
    settings : BusSettings
        How to open it.

    Raises
    ------
    DeviceLost
        If the bus cannot be opened.
    """

    def __init__(self, name: str, settings: BusSettings) -> None:
        super().__init__(open_bus(name, settings))
        self.name = name
        self.settings = settings
        self.tasks: list[Task] = []
        self.errors = 0
        """Error frames that the controller has reported, and messages that make no sense."""
        self.failure = ""
        """Why the bus carries nothing any more; empty while it does."""

    def send_periodic(self, can_id: int, data: Any, period: float, remote: bool = False) -> Any:
        """Send a message again and again from now on, whenever the network is served."""
        task = Task(self, can_id, data, period)
        self.tasks.append(task)
        return task

    def send_due(self, now: float) -> None:
        """Send what is due at a time [s] of `time.monotonic`."""
        for task in self.tasks:
            if now >= task.due:
                task.due = max(task.due + task.period, now)
                self.put(task.message)

    def send_message(self, can_id: int, data: Any, remote: bool = False) -> None:
        """Send a message; see `canopen.Network`."""
        self.put(can.Message(arbitration_id=can_id, data=data, is_extended_id=False))

    def put(self, message: can.Message) -> None:
        """Hand a message to the bus.

        Raises
        ------
        DeviceLost
            If the bus does not take it.
        """
        if self.failure:
            raise DeviceLost(self.failure)
        assert self.bus is not None
        try:
            self.bus.send(message)
        except (can.CanError, OSError) as error:
            self._fail(f"cannot send: {error}", error)

    def receive(self, most: int = MOST_AT_ONCE) -> int:
        """Take what has arrived, and hand each message to those who wait for it.

        Returns the number of messages taken.

        Raises
        ------
        DeviceLost
            If the bus fails, or its controller has left it.
        """
        assert self.bus is not None
        for count in range(most):
            try:
                message = self.bus.recv(0)
            except (can.CanError, OSError) as error:
                self._fail(f"cannot receive: {error}", error)
            if message is None:
                return count
            self.take(message)
        return most

    def take(self, message: can.Message) -> None:
        """Deal with one message."""
        if message.is_error_frame:
            self.errors += 1
            if message.arbitration_id & BUS_OFF:
                self._fail("its controller is off the bus (bus off)")
        elif not message.is_remote_frame and not message.is_extended_id:
            for callback in self.subscribers.get(message.arbitration_id, ()):
                try:
                    callback(message.arbitration_id, message.data, message.timestamp)
                except DeviceLost:
                    raise
                # Messages that are too short or mean nothing make canopen raise what comes.
                except Exception:
                    self.errors += 1

    def reopen(self) -> None:
        """Open the bus anew if it has failed.

        Raises
        ------
        DeviceLost
            If it cannot be opened.
        """
        if not self.failure:
            return
        if self.bus is not None:
            with contextlib.suppress(Exception):
                self.bus.shutdown()
        self.bus = open_bus(self.name, self.settings)
        self.failure, self.errors = "", 0

    def disconnect(self) -> None:
        """Leave the bus; see `canopen.Network`."""
        super().disconnect()
        self.failure = f"bus {self.name} is closed"

    def _fail(self, reason: str, cause: Exception | None = None) -> None:
        self.failure = f"bus {self.name} {reason}"
        raise DeviceLost(self.failure) from cause


class Networks:
    """All buses of the bench, served together by one loop."""

    def __init__(self, networks: Sequence[PolledNetwork]) -> None:
        self.all = tuple(networks)

    def serve(self, now: float) -> None:
        """Send what is due and take what has arrived; waits for nothing.

        Raises
        ------
        DeviceLost
            If a bus fails.
        """
        lost: DeviceLost | None = None
        for network in self.all:
            try:
                if not network.failure:
                    network.send_due(now)
                    network.receive()
            except DeviceLost as error:
                lost = error
        if lost is not None:
            raise lost

    def wait(self, done: Callable[[], bool], seconds: float) -> bool:
        """Serve the buses until something has come about; says whether it has, in time.

        Raises
        ------
        DeviceLost
            If a bus fails.
        """
        until = time.monotonic() + seconds
        while True:
            now = time.monotonic()
            self.serve(now)
            if done():
                return True
            if now >= until:
                return False
            self.nap(min(until - now, self._next_due(now)))

    def nap(self, seconds: float) -> None:
        """Wait for a message on any bus, but no longer than this; takes none that it finds."""
        files = [_file_of(network) for network in self.all if not network.failure]
        known = [file for file in files if file is not None]
        if len(known) < len(files):
            time.sleep(min(seconds, NAP))
        else:
            select.select(known, [], [], max(seconds, 0.0))

    def _next_due(self, now: float) -> float:
        due = [task.due - now for network in self.all for task in network.tasks]
        return max(min(due, default=1.0), 0.0)

    def close(self) -> None:
        """Close all buses. Never raises."""
        for network in self.all:
            with contextlib.suppress(Exception):
                network.disconnect()


def _file_of(network: PolledNetwork) -> int | None:
    """What the system calls the bus, None where it does not know it."""
    assert network.bus is not None
    try:
        return network.bus.fileno()
    except NotImplementedError:
        return None


class PolledSdo(SdoClient):
    """An SDO client that serves the buses while it waits."""

    RESPONSE_TIMEOUT = 0.0
    """`read_response` has waited already."""

    def __init__(
        self,
        rx_cobid: int,
        tx_cobid: int,
        od: ObjectDictionary,
        networks: Networks,
        patience: float,
    ) -> None:
        super().__init__(rx_cobid, tx_cobid, od)  # type: ignore[no-untyped-call]
        self._networks = networks
        self._patience = patience

    def read_response(self) -> bytes:
        """Wait for an answer; see `canopen.sdo.SdoClient`."""
        self._networks.wait(lambda: not self.responses.empty(), self._patience)
        return bytes(super().read_response())  # type: ignore[no-untyped-call]


class PolledNode(RemoteNode):
    """A node of somebody else, spoken to without threads."""

    def __init__(
        self, number: int, objects: ObjectDictionary, networks: Networks, patience: float
    ) -> None:
        self._networks, self._patience = networks, patience
        super().__init__(number, objects)

    def add_sdo(self, rx_cobid: int, tx_cobid: int) -> PolledSdo:
        """Add an SDO channel that waits without a thread."""
        client = PolledSdo(
            rx_cobid, tx_cobid, self.object_dictionary, self._networks, self._patience
        )
        self.sdo_channels.append(client)
        if self.has_network():
            self.network.subscribe(client.tx_cobid, client.on_response)
        return client
