"""How much of a CAN bus the exchange of every tick takes."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from alight.live.devices.cia402.config import DrivesError, DrivesSettings, NodeTransducer

SYNC_BYTES, RPDO_BYTES, TPDO_BYTES, HEARTBEAT_BYTES = 0, 4, 8, 1
MUCH = 0.7
"""Share of a bus above which messages begin to wait for one another noticeably."""


def frame_bits(payload: int) -> int:
    """Longest length [bit] of a classic data frame with an identifier of 11 bits.

    44 bits of frame around the data and 3 between frames; of the 34 bits before the data field's
    end that are not data, and the data, at worst every fourth after the first is followed by a
    stuffed one.

    Parameters
    ----------
    payload : int
        Bytes of data, 0 to 8.
    """
    data = 8 * payload
    return data + 44 + 3 + (34 + data - 1) // 4


@dataclass(frozen=True)
class BusLoad:
    """What one bus carries."""

    name: str
    frames: int
    """Frames in a tick."""
    bits: int
    """Longest they can be, together [bit]."""
    share: float
    """Share of the bus that is taken, heartbeats included."""

    def __str__(self) -> str:
        return (
            f"bus {self.name}: {self.frames} frames a tick, at most {self.bits} bits, "
            f"{self.share:.0%} of its bitrate"
        )


def bus_loads(settings: DrivesSettings, sample_rate: float) -> tuple[BusLoad, ...]:
    """Load of each bus at a sample rate [Hz]."""
    loads = []
    for name, bus in settings.bus.items():
        payloads, nodes = [SYNC_BYTES], 1
        for axis in settings.axis:
            if axis.bus == name:
                payloads += [RPDO_BYTES, TPDO_BYTES]
                nodes += 1
        position = settings.position
        if isinstance(position, NodeTransducer):
            here, station = position.bus == name, 1
        else:
            here, station = settings.axis[position.axis - 1].bus == name, 0
        if here:
            payloads.append(position.bits // 8)
            nodes += station
        bits = sum(frame_bits(payload) for payload in payloads)
        heartbeats = nodes * frame_bits(HEARTBEAT_BYTES) / settings.timing.heartbeat
        share = (bits * sample_rate + heartbeats) / bus.bitrate
        loads.append(BusLoad(name, len(payloads), bits, share))
    return tuple(loads)


def check_loads(settings: DrivesSettings, sample_rate: float, file: str | Path) -> tuple[str, ...]:
    """One line on each bus that carries much.

    Raises
    ------
    DrivesError
        If a bus would have to carry more than it can.
    """
    loads = bus_loads(settings, sample_rate)
    if over := [load for load in loads if load.share > 1]:
        remedy = "give each drive a bus of its own, or lower testbed.sample_rate"
        raise DrivesError(
            file, [f"bus.{load.name}: {load} at {sample_rate:g} Hz; {remedy}" for load in over]
        )
    return tuple(f"{load}: messages wait for one another" for load in loads if load.share > MUCH)
