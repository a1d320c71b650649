"""The transducer of the mass as the host sees it: a node of its own, or an object of a drive."""

from __future__ import annotations

from typing import Any

from alight.live.devices.cia402.config import AnyTransducer, NodeTransducer, Timing
from alight.live.devices.cia402.network import Networks, PolledNetwork
from alight.live.devices.cia402.node import Station
from alight.live.devices.cia402.objects import ENCODERS_PROFILE, Dictionary, communication
from alight.live.devices.cia402.scales import LengthScale


class Transducer(Station):
    """A transducer with a node of its own."""

    profile = ENCODERS_PROFILE

    def __init__(
        self, settings: NodeTransducer, network: PolledNetwork, networks: Networks, timing: Timing
    ) -> None:
        objects = communication(ENCODERS_PROFILE)
        super().__init__("transducer", settings.node, network, networks, objects, timing)


class Reading:
    """The number that tells the position of the mass, carried by a PDO of its own.

    Parameters
    ----------
    settings : AnyTransducer
        What the configuration says of it.
    station : Station
        The node that sends it: a `Transducer`, or a drive.
    pdo : int
        Number of the transmit PDO.
    """

    def __init__(self, settings: AnyTransducer, station: Station, pdo: int) -> None:
        objects = station.node.object_dictionary
        assert isinstance(objects, Dictionary)
        objects.auxiliary(settings.index, settings.subindex, settings.bits, signed=settings.signed)
        self.scale = LengthScale(settings.scale, settings.offset)
        self.raw = 0
        self.fresh = False
        """Whether a measurement has come since this was last set to False."""
        self.owed = 0
        """Measurements that were asked for and have not come."""
        self.name = f"position of the mass, from {station.name}"
        self._settings, self._station, self._pdo = settings, station, pdo

    @property
    def position(self) -> float:
        """Position of the mass [m]."""
        return self.scale.to_position(self.raw)

    def configure(self) -> None:
        """Have it sent on every SYNC.

        Raises
        ------
        DeviceLost
            If the node refuses.
        """
        pdo = self._station.node.tpdo[self._pdo]
        entry = (self._settings.index, self._settings.subindex)
        self._station.map_pdo(pdo, True, entry)
        self._station.listen(pdo, self._on_message)

    def _on_message(self, can_id: int, data: Any, timestamp: float) -> None:
        size = self._settings.bits // 8
        if len(data) >= size:
            self.raw = int.from_bytes(data[:size], "little", signed=self._settings.signed)
            self.fresh, self.owed = True, max(self.owed - 1, 0)
