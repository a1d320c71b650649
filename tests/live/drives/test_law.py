"""The law through drives and buses is the law on the simulated testbed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import alight
from alight.live.devices.cia402.scales import TorqueScale
from alight.live.devices.simulated import SimulatedTestbed
from alight.simulation.closed_loop import SENSORS
from alight.symbolic.signals import Layout
from alight.testbed import SensorState
from tests.live.drives.rig import content, rig, scenario

TICKS = 500
"""Past the first contact."""


def through_drives(given: dict[str, Any], served: bool) -> tuple[np.ndarray, np.ndarray, Layout]:
    """Readings and torques of a run on a rig, and what it had to tell."""
    with rig(given) as made:
        controller = alight.Controller(made.scenario, backend="vm")
        made.enable()
        rows, told = [], []

        def run() -> None:
            for tick in range(TICKS):
                made.drives.read(controller.reading)
                if tick == 0:
                    controller.reset(SensorState(**SENSORS.unpack(controller.reading)))
                controller.step()
                made.drives.write(controller.torque)
                rows.append([*controller.reading, *controller.torque])
                told.append(made.drives.row.copy())
                if not served:
                    made.bench.serve()

        if served:
            with made.served():
                run()
        else:
            run()
        return np.array(rows), np.array(told), Layout(made.drives.signals)


def directly(delay: bool, scales: list[TorqueScale]) -> np.ndarray:
    """The same on the simulated testbed, torques rounded as messages round them."""
    chosen = scenario(**{"testbed.delay": delay})
    testbed = SimulatedTestbed(chosen.closed_loop, chosen.start, backend="vm")
    controller = alight.Controller(chosen, backend="vm")
    before = np.zeros(3)
    testbed.enable()
    testbed.read(before)
    controller.reset(SensorState(**SENSORS.unpack(before)))
    rows = []
    for _ in range(TICKS):
        testbed.read(controller.reading)
        controller.step()
        rows.append([*controller.reading, *controller.torque])
        pairs = zip(scales, controller.torque, strict=True)
        testbed.write(np.array([scale.to_torque(scale.to_raw(tau)) for scale, tau in pairs]))
    return np.array(rows)


def test_pipelined_is_the_testbed_with_a_delay_of_one_sample() -> None:
    found, told, layout = through_drives(content(), served=False)
    expected = directly(True, [TorqueScale(240.0), TorqueScale(20.0)])
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9)
    assert told[:, layout.slices()["F_m"]].max() > 10.0  # it has struck
    assert not told[:, layout.slices()["silence"]].any()


def test_fresh_is_the_testbed_without_a_delay() -> None:
    given = content(exchange="fresh", fresh_wait=1e5)
    found, _, _ = through_drives(given, served=True)
    expected = directly(False, [TorqueScale(240.0), TorqueScale(20.0)])
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9)


def test_gear_direction_and_zero_of_an_axis_change_nothing_but_the_rounding() -> None:
    given = content()
    geared = {"rated_torque": 2.0, "gear": 100.0, "direction": -1, "zero": 0.4, "increments": 6144}
    given["axis"][0] |= geared
    found, _, _ = through_drives(given, served=False)
    expected = directly(True, [TorqueScale(2.0, 100.0, -1), TorqueScale(20.0)])
    # Before contact, which magnifies the half increment by which the zero is off the grid.
    np.testing.assert_allclose(found[:200, :3], expected[:200, :3], rtol=0, atol=3e-4)


def test_what_drives_tell_is_told_under_the_names_of_the_simulation() -> None:
    found, told, layout = through_drives(content(), served=False)
    places = layout.slices()
    np.testing.assert_array_equal(told[:, places["q"]], found[:, :2])
    np.testing.assert_array_equal(told[:, places["tau_applied"]], found[:, 3:])
    arm = scenario().plant.arm
    np.testing.assert_allclose(
        told[-1, places["x_r"]], np.asarray(arm.x_r(found[-1, :2])), rtol=1e-12
    )
    assert not told[:, places["z"]].any() and not told[:, places["F_t"]].any()
    # The drives report the torque that they took with the SYNC which they answer.
    sent = [TorqueScale(240.0), TorqueScale(20.0)]
    for axis, scale in enumerate(sent):
        column = places["torque_actual"].start + axis
        raw = [scale.to_raw(tau) for tau in found[:-1, 3 + axis]]
        assert told[1:, column] == pytest.approx([scale.to_torque(r) for r in raw])
