"""A drives file is refused with file, field, value, and what would be right."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from alight.errors import AlightError
from alight.live.devices.cia402.bus_load import check_loads
from alight.live.devices.cia402.config import DrivesError, drives_from, load_drives
from tests.cli.command import invoke
from tests.live.drives.rig import changed, content

EXAMPLES = Path(__file__).parents[3] / "examples"


@pytest.mark.parametrize("name", ["drives.toml", "drives_simulated.toml"])
def test_the_examples_are_good_at_two_kilohertz(name: str) -> None:
    settings = load_drives(EXAMPLES / name)
    assert check_loads(settings, 2000.0, name) == ()


@pytest.mark.parametrize(
    ("path", "value", "said"),
    [
        (("axis", 0, "node"), 128, "axis.0.node = 128: Input should be less than or equal to 127"),
        (("axis", 0, "gear"), 0.0, "axis.0.gear = 0.0: Input should be greater than 0"),
        (("axis", 1, "direction"), 2, "axis.1.direction = 2: Input should be 1 or -1"),
        (("axis", 0, "mode"), "velocity", "axis.0.mode = 'velocity': Input should be"),
        (("axis", 0, "bus"), "x", "axis.0.bus = 'x': there is no table [bus.x]; one of: s, e, t"),
        (("axis", 0, "nod"), 1, "axis.0.nod: unknown name"),
        (("axis", 0, "node"), 127, "axis.0.node = 127: is taken on that bus by the host's node"),
        (("position", "scale"), 0.0, "position.scale = 0.0: Input should not be zero"),
        (("position", "type"), "laser", "position.type = 'laser': Input should be one of"),
        (("timing", "watchdog"), 0.06, "watchdog = 0.06 must be at least twice heartbeat"),
        (("timing", "exchange"), "x", "timing.exchange = 'x': Input should be"),
        (("bus", "s", "bitrate"), 2_000_000, "bus.s.bitrate = 2000000: Input should be less"),
    ],
)
def test_a_bad_value_is_named_with_what_would_be_right(
    path: tuple[Any, ...], value: Any, said: str
) -> None:
    with pytest.raises(DrivesError) as caught:
        drives_from(changed(content(), *path, value=value), "bench.toml")
    assert str(caught.value).startswith("bench.toml:\n  ")
    assert said in str(caught.value)


def test_two_nodes_of_one_number_on_one_bus_are_refused() -> None:
    given = changed(content(), "position", "bus", value="s")
    with pytest.raises(DrivesError, match=r"position\.node = 1: is taken on that bus by axis\.0"):
        drives_from(changed(given, "position", "node", value=1), "bench.toml")


def test_one_axis_is_not_enough() -> None:
    given = content()
    with pytest.raises(DrivesError, match=r"axis\.1: missing"):
        drives_from({**given, "axis": given["axis"][:1]}, "bench.toml")


@pytest.mark.parametrize(
    ("text", "said"), [(b"axis = [", "is not valid TOML"), (b"\xff", "is not UTF-8")]
)
def test_a_file_that_is_none_is_refused(tmp_path: Path, text: bytes, said: str) -> None:
    (tmp_path / "d.toml").write_bytes(text)
    with pytest.raises(DrivesError, match=said):
        load_drives(tmp_path / "d.toml")
    with pytest.raises(AlightError, match="cannot be read"):
        load_drives(tmp_path / "none.toml")


def test_the_command_refuses_a_bad_file_before_anything_starts(tmp_path: Path) -> None:
    (tmp_path / "d.toml").write_text("node = 300\n")
    result = invoke("live", "experiment-1", "--drives", str(tmp_path / "d.toml"))
    assert result.exit_code == 2
    assert "node = 300: Input should be less than or equal to 127" in result.stderr


def test_the_command_refuses_a_rate_that_a_bus_cannot_carry(tmp_path: Path) -> None:
    example = (EXAMPLES / "drives.toml").read_text()
    (tmp_path / "d.toml").write_text(example.replace("1000000", "500000"))
    result = invoke("live", "experiment-1", "--drives", str(tmp_path / "d.toml"))
    assert result.exit_code == 2
    assert "bus.shoulder: bus shoulder: 3 frames a tick, at most 285 bits, 115%" in result.stderr
