"""A node of the bench as the host sees it: identity, heartbeat, emergencies, PDOs."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from canopen import ObjectDictionary
from canopen.emcy import EmcyError
from canopen.pdo.base import PdoMap
from canopen.sdo.exceptions import SdoAbortedError, SdoError

from alight.live.devices.cia402.config import ObjectValue, Timing
from alight.live.devices.cia402.emergency import in_words
from alight.live.devices.cia402.network import Networks, PolledNetwork, PolledNode
from alight.live.devices.cia402.objects import (
    CONSUMER_HEARTBEAT,
    CYCLE_PERIOD,
    DEVICE_TYPE,
    PRODUCER_HEARTBEAT,
)
from alight.live.devices.device import DeviceLost

BOOT_UP, OPERATIONAL = 0, 5
ON_EVERY_SYNC, ON_EVENT = 1, 255
"""Transmission types of a PDO."""


class Station:
    """What is common to drives and transducers.

    Parameters
    ----------
    name : str
        As messages call it: "axis 1".
    number : int
        Number of the node.
    network : PolledNetwork
        Its bus.
    networks : Networks
        All buses, served while this one is waited for.
    objects : ObjectDictionary
        What is known of its objects.
    timing : Timing
        Periods and patience.
    """

    def __init__(
        self,
        name: str,
        number: int,
        network: PolledNetwork,
        networks: Networks,
        objects: ObjectDictionary,
        timing: Timing,
    ) -> None:
        self.name = f"{name} (node {number} on bus {network.name})"
        self.timing = timing
        self.network = network
        self.node = PolledNode(number, objects, networks, timing.answer)
        network.add_node(self.node)
        self.node.nmt.add_heartbeat_callback(self._on_heartbeat)
        self.node.emcy.add_callback(self._on_emergency)
        self.heard = 0.0
        """When its last heartbeat came, on `time.monotonic`; 0 before the first."""
        self.nmt = BOOT_UP
        self.emergency: EmcyError | None = None
        """The last emergency that was not taken back."""
        self.configured = False

    def _on_heartbeat(self, state: int) -> None:
        self.heard = time.monotonic()
        self.nmt = state
        if state == BOOT_UP:
            self.configured = False

    def _on_emergency(self, message: EmcyError) -> None:
        self.emergency = message if message.code & 0xFF00 else None

    @property
    def emergency_text(self) -> str:
        """Its last emergency in words, empty without one."""
        if self.emergency is None:
            return ""
        return f"reports emergency {in_words(self.emergency.code)}"

    def trouble(self, now: float) -> str:
        """Why it cannot be relied on now; empty if it can."""
        if self.heard and now - self.heard > self.timing.watchdog:
            return f"{self.name}: no heartbeat for {now - self.heard:.3f} s"
        if not self.configured:
            return f"{self.name}: has restarted and lost its settings; reset the bench"
        if self.heard and self.nmt not in (OPERATIONAL, BOOT_UP):
            return f"{self.name}: is not operational any more (NMT state {self.nmt})"
        return ""

    # Configuration over SDO

    profile = 0
    """Number of the device profile that it should have."""

    def identify(self) -> None:
        """Make sure that the node is there and of the kind that fits.

        Raises
        ------
        DeviceLost
            If it does not answer, or is something else.
        """
        found = self.ask(DEVICE_TYPE) & 0xFFFF
        if found != self.profile:
            raise DeviceLost(
                f"{self.name}: is no device of CiA {self.profile}: its object 0x1000 says {found}"
            )

    def ask(self, index: int, subindex: int = 0) -> int:
        """Value of an object.

        Raises
        ------
        DeviceLost
            If there is no answer, or the node has no such object.
        """
        return int(self._sdo(index, subindex, "read", lambda entry: entry.raw))

    def tell(self, index: int, value: int, subindex: int = 0, *, needed: bool = True) -> bool:
        """Write an object; says whether the node took it.

        Raises
        ------
        DeviceLost
            If there is no answer, or the node refuses what is ``needed``.
        """

        def write(entry: Any) -> bool:
            entry.raw = value
            return True

        try:
            return bool(self._sdo(index, subindex, f"set to {value}", write))
        except DeviceLost as error:
            if needed or not isinstance(error.__cause__, SdoAbortedError):
                raise
            return False

    def tell_raw(self, setting: ObjectValue) -> None:
        """Write an object that only the configuration knows.

        Raises
        ------
        DeviceLost
            If there is no answer, or the node refuses it.
        """
        data = setting.value.to_bytes(setting.bits // 8, "little", signed=setting.value < 0)
        try:
            self.node.sdo.download(setting.index, setting.subindex, data)
        except SdoError as error:
            self._refused(setting.index, setting.subindex, f"set to {setting.value}", error)

    def _sdo(self, index: int, subindex: int, what: str, action: Callable[[Any], Any]) -> Any:
        entry = self.node.sdo[index]
        try:
            return action(entry if not subindex else entry[subindex])
        except SdoError as error:
            self._refused(index, subindex, what, error)

    def _refused(self, index: int, subindex: int, what: str, error: SdoError) -> None:
        place = f"object 0x{index:04X}" + (f":{subindex}" if subindex else "")
        if isinstance(error, SdoAbortedError):
            raise DeviceLost(f"{self.name}: {place} cannot be {what}: {error}") from error
        raise DeviceLost(
            f"{self.name}: does not answer ({place}); see power, wiring, node number and bitrate"
        ) from error

    def watch_one_another(self, host: int, sample_time: float) -> None:
        """Set its heartbeat, its watchdog on the host's, and the period of SYNC.

        Raises
        ------
        DeviceLost
            If it has no heartbeat, or no watchdog.
        """
        milliseconds = round(1000 * self.timing.watchdog)
        self.tell(CYCLE_PERIOD, round(1e6 * sample_time), needed=False)
        self.tell(PRODUCER_HEARTBEAT, max(round(1000 * self.timing.heartbeat), 1))
        self.tell(CONSUMER_HEARTBEAT, host << 16 | milliseconds, 1)

    def forget_host(self) -> None:
        """End its watchdog, as the host is about to leave in order.

        Raises
        ------
        DeviceLost
            If it does not answer.
        """
        self.tell(CONSUMER_HEARTBEAT, 0, 1)

    def map_pdo(self, pdo: PdoMap, on_sync: bool, *entries: tuple[int, int]) -> None:
        """Have a PDO carry these objects, each index and subindex.

        Raises
        ------
        DeviceLost
            If the node refuses.
        """
        pdo.clear()
        for index, subindex in entries:
            pdo.add_variable(index, subindex)
        pdo.cob_id = pdo.predefined_cob_id
        pdo.trans_type = ON_EVERY_SYNC if on_sync else ON_EVENT
        pdo.enabled = True
        try:
            pdo.save()
        except SdoError as error:
            self._refused(pdo.com_record.od.index, 0, "mapped", error)

    def listen(self, pdo: PdoMap, callback: Callable[[int, Any, float], None]) -> None:
        """Have a function called on each message of a PDO, and nothing else."""
        assert pdo.cob_id is not None
        self.network.subscribers[pdo.cob_id] = [callback]

    def start(self) -> None:
        """Let it exchange PDOs."""
        self.node.nmt.state = "OPERATIONAL"
        self.nmt = OPERATIONAL
        self.configured = True
