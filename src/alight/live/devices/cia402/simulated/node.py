"""A simulated CANopen node: NMT, SDO, PDO, SYNC, heartbeats both ways."""

from __future__ import annotations

import struct
import time
from dataclasses import dataclass
from typing import Any

import can
from canopen import LocalNode
from canopen.objectdictionary import ODVariable
from canopen.objectdictionary.datatypes import SIGNED_TYPES
from canopen.pdo.base import PdoMap

from alight.live.devices.cia402.network import PolledNetwork
from alight.live.devices.cia402.objects import CONSUMER_HEARTBEAT, HEARTBEAT, Dictionary

LAST_SYNCHRONOUS = 240
"""Last transmission type of a PDO that goes with SYNC."""
RESET_COMMANDS = (129, 130)


@dataclass(frozen=True)
class Frame:
    """A PDO as it is configured: where which object stands."""

    form: struct.Struct
    entries: tuple[tuple[int, int], ...]
    message: can.Message
    at_once: bool
    """Whether it goes without SYNC."""

    @classmethod
    def of(cls, pdo: PdoMap) -> Frame:
        """Read it off a PDO."""
        types = (entry.od.data_type or 0 for entry in pdo)
        forms = "".join(ODVariable.STRUCT_TYPES[number].format[-1] for number in types)
        form = struct.Struct(f"<{forms}")
        message = can.Message(
            arbitration_id=pdo.cob_id or 0, data=bytes(form.size), is_extended_id=False
        )
        entries = tuple((entry.index, entry.subindex) for entry in pdo)
        return cls(form, entries, message, (pdo.trans_type or 0) > LAST_SYNCHRONOUS)


class SimulatedNode:
    """What drives and transducers have in common.

    Parameters
    ----------
    number : int
        Number of the node.
    network : PolledNetwork
        Its bus.
    objects : Dictionary
        Its objects.
    """

    def __init__(self, number: int, network: PolledNetwork, objects: Dictionary) -> None:
        self.number, self.network = number, network
        self.node = LocalNode(number, objects)
        network[number] = self.node
        network.subscribe(0, self._on_nmt)
        self.image: dict[tuple[int, int], int] = {}
        """What it shows of itself: values of objects, by index and subindex."""
        self._settings: dict[tuple[int, int], int] = {}
        self._sent: list[Frame] = []
        self._taken: dict[int, Frame] = {}
        self.node.add_read_callback(lambda index, subindex, od: self.image.get((index, subindex)))
        self.node.add_write_callback(self._on_write)
        self._host, self._patience = 0, 0.0
        self._heard = 0.0
        self.plugged = True
        """Whether it is on the bus at all; taken off, it neither hears nor says anything."""
        self.boot()

    def boot(self) -> None:
        """Come up as after switching on: say so, then wait to be configured."""
        self.node.data_store.clear()
        self._settings.clear()
        self._close_pdos()
        self._listen_to(0)
        self.node.nmt.stop_heartbeat()
        self.node.nmt.state = "INITIALISING"
        self.node.nmt.state = "PRE-OPERATIONAL"
        self.booted()

    def booted(self) -> None:
        """Set what a node of this kind begins with."""

    def unplug(self) -> None:
        """Take it off the bus, as if its plug were pulled: its power stays."""
        if self.plugged:
            self.plugged = False
            self.node.nmt.stop_heartbeat()
            self._close_pdos()
            self.network.unsubscribe(0, self._on_nmt)
            if self._host:  # it goes on waiting for a heartbeat
                self.network.unsubscribe(HEARTBEAT + self._host, self._on_host)
            del self.network[self.number]

    def plug(self) -> None:
        """Put it back on the bus, after a restart."""
        if not self.plugged:
            self.plugged = True
            self._host = 0
            self.network[self.number] = self.node
            self.network.subscribe(0, self._on_nmt)
            self.boot()

    @property
    def operational(self) -> bool:
        """Whether it exchanges PDOs."""
        return self.plugged and self.node.nmt.state == "OPERATIONAL"

    def value(self, index: int, subindex: int = 0) -> int:
        """Value of one of its objects."""
        place = index, subindex
        if place in self.image:
            return self.image[place]
        if place not in self._settings:
            data = self.node.get_data(index, subindex)
            entry = self.node.object_dictionary.get_variable(index, subindex)
            signed = entry is not None and entry.data_type in SIGNED_TYPES
            self._settings[place] = int.from_bytes(data, "little", signed=signed)
        return self._settings[place]

    def put(self, index: int, value: int, subindex: int = 0) -> None:
        """Show something in one of its objects."""
        self.image[index, subindex] = value

    # What arrives

    def _on_nmt(self, can_id: int, data: Any, timestamp: float) -> None:
        if len(data) >= 2 and data[1] in (0, self.number):
            if data[0] in RESET_COMMANDS:
                self.boot()
            elif self.operational:
                self._open_pdos()

    def _open_pdos(self) -> None:
        """Use the PDOs as they are configured now."""
        self._close_pdos()
        self.node.rpdo.read()
        self.node.tpdo.read()
        self._sent = [Frame.of(pdo) for pdo in self.node.tpdo.values() if pdo.enabled]
        for pdo in self.node.rpdo.values():
            if pdo.enabled and pdo.cob_id:
                self._taken[pdo.cob_id] = Frame.of(pdo)
                self.network.subscribers[pdo.cob_id] = [self._on_rpdo]

    def _close_pdos(self) -> None:
        for can_id in self._taken:
            self.network.subscribers.pop(can_id, None)
        self._taken.clear()
        self._sent.clear()

    def _on_rpdo(self, can_id: int, data: Any, timestamp: float) -> None:
        frame = self._taken[can_id]
        if self.operational and len(data) >= frame.form.size:
            values = frame.form.unpack_from(data)
            self.addressed(dict(zip(frame.entries, values, strict=True)), frame.at_once)

    def sync(self) -> None:
        """Act on SYNC: take what was sent before it, and send what it asks for."""
        if self.operational:
            self.synchronised()
            for frame in self._sent:
                if not frame.at_once:
                    values = (self.value(*place) for place in frame.entries)
                    frame.form.pack_into(frame.message.data, 0, *values)
                    self.network.put(frame.message)

    def _on_write(self, index: int, subindex: int, data: bytes, **_: Any) -> None:
        self._settings.pop((index, subindex), None)
        if index == CONSUMER_HEARTBEAT and subindex == 1:
            setting = int.from_bytes(data, "little")
            self._listen_to(setting >> 16 & 0x7F)
            self._patience = (setting & 0xFFFF) / 1000.0
        self.written(index, int.from_bytes(data, "little", signed=True))

    def _listen_to(self, host: int) -> None:
        if self._host:
            self.network.unsubscribe(HEARTBEAT + self._host, self._on_host)
        self._host, self._heard = host, 0.0
        if host:
            self.network.subscribe(HEARTBEAT + host, self._on_host)

    def _on_host(self, can_id: int, data: Any, timestamp: float) -> None:
        self._heard = time.monotonic()

    def host_silent(self, now: float) -> float:
        """Time [s] since the host's last heartbeat where that is too long, else 0.

        It is watched from its first heartbeat on.
        """
        silent = now - self._heard
        lost = self._host and self._patience and self._heard and silent > self._patience
        return silent if lost else 0.0

    # What kinds of nodes do

    def addressed(self, values: dict[tuple[int, int], int], at_once: bool) -> None:
        """Deal with an RPDO, values by index and subindex: at once, or with the next SYNC."""

    def synchronised(self) -> None:
        """Deal with SYNC, before the TPDOs are sent."""

    def written(self, index: int, value: int) -> None:
        """Deal with an object that was written."""

    def watch(self, now: float) -> None:
        """See whether something is overdue."""
