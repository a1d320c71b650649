"""Opening: what nodes are told over SDO, and what is refused."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import pytest
import tomlkit

from alight.live.devices import DeviceLost
from alight.live.devices.cia402 import Drives, open_drives
from alight.live.devices.cia402.config import DrivesError, drives_from
from alight.live.devices.cia402.network import PolledNetwork
from alight.live.devices.cia402.simulated.bench import SimulatedBench
from tests.live.drives.rig import Rig, changed, content, rig, scenario


def test_what_a_drive_was_told() -> None:
    with rig() as made:
        first, second = made.bench.drives

        def mapped(index: int) -> list[int]:
            return [first.value(index, n) for n in range(1, first.value(index, 0) + 1)]

        assert mapped(0x1600) == [0x60400010, 0x60710010]
        assert mapped(0x1A00) == [0x60410010, 0x60640020, 0x60770010]
        assert first.value(0x1400, 1) == 0x201 and second.value(0x1400, 1) == 0x202
        assert first.value(0x1800, 1) == 0x181
        assert first.value(0x1400, 2) == first.value(0x1800, 2) == 1  # with every SYNC
        assert first.value(0x1016, 1) == 127 << 16 | 5000
        assert first.value(0x1017) == 50
        assert first.value(0x1006) == 500
        assert first.value(0x60C2, 1) == 5 and first.value(0x60C2, 2) == 0x100 - 4
        assert first.value(0x6060) == first.value(0x6061) == 10
        assert first.value(0x6072) == 1000 and second.value(0x6072) == 1000
        assert made.node(3).value(0x1A00, 1) == 0x60040020
        assert made.states() == ["Switch on disabled"] * 2


def test_fresh_targets_act_without_sync() -> None:
    with rig(content(exchange="fresh")) as made:
        assert made.bench.drives[0].value(0x1400, 2) == 255
        assert made.bench.drives[0].value(0x1800, 2) == 1


def test_profile_torque_mode_has_no_slope() -> None:
    given = changed(content(), "axis", 0, "mode", value="profile-torque")
    with rig(given) as made:
        drive = made.bench.drives[0]
        assert drive.value(0x6061) == 4
        assert drive.value(0x6087) & 0xFFFFFFFF == 0xFFFFFFFF
        made.enable()
        made.tick(24.0, 2.0)
        assert made.torques() == [100, 100]


def test_ratings_that_the_file_leaves_out_are_asked_for() -> None:
    given = content()
    del given["axis"][1]["rated_torque"], given["axis"][1]["increments"]
    with rig(given) as made:
        scales = made.drives.crew.drives[1]
        assert scales.torque_scale.rated == 1.0
        assert scales.angle_scale.increments == 614400


def test_objects_of_the_file_are_written_first() -> None:
    extra = [{"index": 0x605A, "bits": 16, "value": 6}]
    with rig(changed(content(), "axis", 0, "objects", value=extra)) as made:
        assert made.bench.drives[0].value(0x605A) == 6
        assert made.bench.drives[1].value(0x605A) == 2


def test_an_object_that_there_is_not_is_refused_by_name() -> None:
    extra = [{"index": 0x5FFF, "bits": 8, "value": 1}]
    given = changed(content(), "axis", 0, "objects", value=extra)
    said = r"axis 1 .*object 0x5FFF cannot be set to 1"
    with rig(given, opened=False) as made, pytest.raises(DeviceLost, match=said):
        made.open()


@pytest.mark.parametrize(
    ("index", "value", "said"),
    [
        (0x1000, 401, "axis 1 .*is no device of CiA 402: its object 0x1000 says 401"),
        (0x6502, 0x3FF - (1 << 9), "has no mode 'cyclic-synchronous-torque'"),
    ],
)
def test_what_is_no_drive_in_torque_mode_is_refused(index: int, value: int, said: str) -> None:
    with rig(opened=False) as made:
        made.bench.drives[0].put(index, value)
        with pytest.raises(DeviceLost, match=said):
            made.open()


def test_a_node_that_is_not_there_is_said_to_be_missing() -> None:
    with rig(content(answer=0.05), opened=False) as made:
        made.node(2).unplug()
        with pytest.raises(DeviceLost, match=r"axis 2 \(node 2 on bus e\): does not answer"):
            made.open()


def test_a_bus_that_cannot_be_opened_is_named() -> None:
    given = changed(content(), "bus", "s", "interface", value="no such thing")
    with pytest.raises(DeviceLost, match=r"bus s: no such thing .* cannot be opened"):
        Drives(drives_from(given, "f"), scenario(), backend="vm")


def test_a_position_may_come_from_a_drive() -> None:
    given = content()
    given["position"] = {
        "type": "drive", "axis": 2, "index": 0x60E4, "subindex": 1, "scale": -1e-6, "offset": 0.3,
    }  # fmt: skip
    with rig(given) as made:
        assert made.node(2).value(0x1A01, 1) == 0x60E40120
        made.tick()
        assert made.tick()[2] == pytest.approx(made.scenario.start.x_m, abs=2e-6)


def test_a_file_is_opened_and_a_bus_that_is_too_slow_refused(tmp_path: Path) -> None:
    def written(given: dict[str, Any]) -> Path:
        path = tmp_path / "drives.toml"
        path.write_text(tomlkit.dumps(given))
        return path

    given = content()
    slow = changed(given, "bus", "s", "bitrate", value=250_000)
    with pytest.raises(DrivesError, match=r"drives\.toml:\n  bus\.s: .* give each drive a bus"):
        open_drives(written(slow), scenario())
    made = Rig(drives_from(given, "f"), scenario())
    with made.served():
        drives = open_drives(written(given), made.scenario)
        drives.close()
    made.bench.close()


def test_a_bus_that_is_much_loaded_is_said_once(tmp_path: Path) -> None:
    given = changed(content(), "bus", "s", "bitrate", value=800_000)
    (tmp_path / "d.toml").write_text(tomlkit.dumps(given))
    made = Rig(drives_from(given, "f"), scenario())
    with made.served():
        with pytest.warns(UserWarning, match="bus s: 3 frames a tick.*wait for one another"):
            drives = open_drives(tmp_path / "d.toml", made.scenario)
        drives.close()
    made.bench.close()


def test_closing_ends_the_watchdogs_and_stops_the_nodes() -> None:
    with rig() as made:
        made.enable()
        made.tick(24.0, 2.0)
        with made.served():
            made.drives.close()
        for node in made.bench.nodes:
            assert node.value(0x1016, 1) == 0
            assert node.node.nmt.state == "STOPPED"
        assert made.states() == ["Switch on disabled"] * 2 and made.torques() == [0, 0]


def test_frames_of_strangers_do_no_harm() -> None:
    with rig() as made:
        made.enable()
        settings = made.settings.bus["s"]
        stranger = PolledNetwork("stranger", settings)
        for can_id, data in [(0x181, b"\1"), (0x081, b""), (0x701, b""), (0x581, b"\0" * 8)]:
            stranger.send_message(can_id, data)
        stranger.send_message(0x123, struct.pack("<q", -1))
        for _ in range(3):
            made.tick(24.0, 2.0)
        stranger.disconnect()
        assert made.torques() == [100, 100]


def test_a_bench_takes_no_name_for_another() -> None:
    given = content()
    settings = drives_from(given, "f")
    bench = SimulatedBench(settings, scenario(), backend="vm")
    assert [node.number for node in bench.nodes] == [1, 2, 3]
    bench.close()
