"""What a tick takes of a bus, against frames built bit by bit."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from alight.live.devices.cia402.bus_load import bus_loads, check_loads, frame_bits
from alight.live.devices.cia402.config import DrivesError, drives_from
from tests.live.drives.rig import changed, content

POLYNOMIAL = 0x4599
AFTER_CRC = 1 + 2 + 7 + 3
"""Delimiter of the checksum, acknowledgement with its own, end of frame, pause between frames."""


def stuffed_bits(identifier: int, data: bytes) -> int:
    """Bits of a classic data frame and the pause after it, as they go over the wire."""
    head = f"0{identifier:011b}000{len(data):04b}"
    body = head + "".join(f"{byte:08b}" for byte in data)
    checksum = 0
    for bit in body:
        flip = int(bit) ^ (checksum >> 14 & 1)
        checksum = (checksum << 1 & 0x7FFF) ^ (POLYNOMIAL if flip else 0)
    body += f"{checksum:015b}"
    length, run, last = 0, 0, ""
    for bit in body:
        length += 1
        run, last = (run + 1 if bit == last else 1), bit
        if run == 5:
            length += 1
            run, last = 1, "1" if bit == "0" else "0"
    return length + AFTER_CRC


@given(st.integers(0, 0x7FF), st.binary(max_size=8))
def test_no_frame_is_longer_than_said_nor_shorter_than_without_stuffing(
    identifier: int, data: bytes
) -> None:
    bits = stuffed_bits(identifier, data)
    assert 47 + 8 * len(data) <= bits <= frame_bits(len(data))


def test_known_lengths() -> None:
    # The longest classic frame with 8 bytes: 111 bits and up to 24 stuffed ones.
    assert [frame_bits(n) for n in (0, 4, 8)] == [55, 95, 135]


def test_a_drive_on_its_own_bus_fits_at_two_kilohertz() -> None:
    given_ = content()
    loads = {load.name: load for load in bus_loads(drives_from(given_, "f"), 2000.0)}
    assert loads["s"].frames == loads["e"].frames == 3
    assert loads["s"].bits == 55 + 95 + 135
    assert loads["s"].share == pytest.approx((285 * 2000 + 2 * 65 / 0.05) / 1e6)
    assert check_loads(drives_from(given_, "f"), 2000.0, "f") == ()


def test_two_drives_on_one_bus_do_not_and_are_refused() -> None:
    both = changed(content(), "axis", 1, "bus", value="s")
    with pytest.raises(DrivesError, match=r"bus\.s: .*% of its bitrate at 2000 Hz; give each"):
        check_loads(drives_from(both, "f"), 2000.0, "f")
    assert check_loads(drives_from(both, "f"), 1000.0, "f") == ()


def test_much_is_said_before_it_is_too_much() -> None:
    shared = changed(content(), "position", "bus", value="s")
    (line,) = check_loads(drives_from(shared, "f"), 2000.0, "f")
    assert line.startswith("bus s: 4 frames a tick")


def test_a_position_that_a_drive_sends_loads_the_bus_of_that_drive() -> None:
    given_ = content()
    given_["position"] = {"type": "drive", "axis": 2, "index": 0x60E4, "scale": 1e-6}
    loads = {load.name: load.frames for load in bus_loads(drives_from(given_, "f"), 1000.0)}
    assert loads == {"s": 3, "e": 4, "t": 1}
