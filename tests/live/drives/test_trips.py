"""Whatever happens to drives, buses or host: no torque, and a reason."""

from __future__ import annotations

import time

import can
import numpy as np
import pytest
from can.interfaces.virtual import VirtualBus

from alight.live.devices import DeviceLost
from alight.live.devices.cia402.network import PolledNetwork
from alight.live.devices.cia402.states import LIMITED
from alight.symbolic.signals import Layout
from tests.live.drives.rig import Rig, content, rig

PUSH = (24.0, 2.0)
"""A tenth of the rated torques."""


def running(made: Rig) -> None:
    """A run at torque."""
    made.enable()
    for _ in range(3):
        made.tick(*PUSH)
    assert made.states() == ["Operation enabled"] * 2
    assert made.torques() == [100, 100]


def is_safe(made: Rig) -> None:
    """After `disable`, whose messages the bench has had time to take."""
    made.drives.disable()
    for _ in range(4):
        made.bench.serve()
    assert made.torques() == [0, 0]
    assert "Operation enabled" not in made.states()


def goes_on_after_a_reset(made: Rig) -> None:
    made.reset()
    running(made)


def test_a_run_ends_with_quick_stop_and_the_power_stage_off() -> None:
    with rig() as made:
        running(made)
        made.changes.clear()
        is_safe(made)
        first = [change["state"] for change in made.changes if change["node"] == 1]
        assert first == ["Quick stop active", "Switch on disabled"]
        made.tick(*PUSH)  # not enabled: nothing of it arrives
        made.tick(*PUSH)
        assert made.torques() == [0, 0]
        running(made)


def test_the_encoders_stay_awake_before_and_after_a_run() -> None:
    with rig() as made:
        for _ in range(5):
            made.tick()
        running(made)
        is_safe(made)
        seen = [made.tick()[0] for _ in range(20)]  # it coasts
        assert len(set(seen)) > 3
        assert not made.drives.row[-3:].any()


@pytest.mark.parametrize("number", [1, 2, 3])
def test_a_plug_that_is_pulled(number: int) -> None:
    with rig(content(answer=0.05)) as made:
        running(made)
        made.node(number).unplug()
        said = made.until_lost(*PUSH)
        assert f"(node {number} on" in said and said.endswith("no measurement for 5 ticks")
        is_safe(made) if number == 3 else made.drives.disable()
        with pytest.raises(DeviceLost, match="no measurement"):  # until it is reset
            made.tick()
        with pytest.raises(DeviceLost, match=f"node {number} .*does not answer"):
            made.reset()
        made.node(number).plug()
        goes_on_after_a_reset(made)


def test_a_drive_that_was_pulled_off_goes_to_zero_torque_by_its_watchdog() -> None:
    with rig(content(watchdog=0.2)) as made:
        running(made)
        made.node(1).unplug()
        assert made.torques()[0] == 100  # its power stage does not know yet
        made.serve_until(lambda: made.states()[0] == "Fault")
        assert made.torques()[0] == 0


def test_a_drive_that_reports_an_emergency() -> None:
    with rig() as made:
        running(made)
        made.bench.drives[1].fault(0x4310)
        said = made.until_lost(*PUSH)
        assert said == (
            "axis 2 (node 2 on bus e): reports emergency 0x4310, temperature of the motor too high"
        )
        is_safe(made)
        assert made.states() == ["Switch on disabled", "Fault"]
        with pytest.raises(DeviceLost, match=r"is in a fault: it reports emergency 0x4310.*reset"):
            made.enable()
        goes_on_after_a_reset(made)


def test_a_fault_that_does_not_clear() -> None:
    with rig(content(state=0.1)) as made:
        running(made)
        hot = made.bench.drives[0]
        hot.fault(0x4310)
        made.until_lost(*PUSH)
        made.bench._tell_of = lambda change: (
            hot.fault(0x4310) if change["cause"] == "fault reset" else None
        )
        with pytest.raises(
            DeviceLost, match=r"axis 1 .*its fault does not clear: it reports .*4310"
        ):
            made.reset()


def test_a_drive_that_leaves_operation() -> None:
    with rig() as made:
        running(made)
        stranger = PolledNetwork("stranger", made.settings.bus["s"])
        stranger.send_message(0x201, b"\x06\x00\x00\x00")  # shutdown
        stranger.send_message(0x080, b"")
        made.serve_until(lambda: made.states()[0] != "Operation enabled")
        stranger.disconnect()
        with pytest.raises(DeviceLost, match=r"axis 1 .*left Operation enabled, it is in Ready to"):
            made.tick(*PUSH)
        is_safe(made)
        goes_on_after_a_reset(made)


def test_a_node_that_restarts() -> None:
    with rig() as made:
        running(made)
        stranger = PolledNetwork("stranger", made.settings.bus["t"])
        stranger.send_message(0, bytes([129, 3]))
        made.bench.serve()
        stranger.disconnect()
        assert "has restarted and lost its settings" in made.until_lost(*PUSH)
        is_safe(made)
        goes_on_after_a_reset(made)


def test_a_heartbeat_that_stops_although_measurements_come() -> None:
    with rig(content(watchdog=0.2)) as made:
        running(made)
        made.node(2).node.nmt.stop_heartbeat()
        assert "axis 2 (node 2 on bus e): no heartbeat for" in made.until_lost(*PUSH)
        is_safe(made)
        goes_on_after_a_reset(made)


def test_a_host_that_stands_still_is_dead_to_the_drives() -> None:
    with rig(content(watchdog=0.2)) as made:
        running(made)
        made.changes.clear()
        made.serve_until(lambda: made.states() == ["Fault"] * 2)
        assert made.torques() == [0, 0]
        causes = " ".join(change["cause"] for change in made.changes)
        assert "0x8130" in causes or "0x8250" in causes
        said = made.until_lost(*PUSH)
        assert "reports emergency 0x8" in said or "no heartbeat" in said
        is_safe(made)
        goes_on_after_a_reset(made)


def test_a_host_that_only_beats_is_dead_to_the_drives_too() -> None:
    with rig(content(watchdog=0.2)) as made:
        running(made)

        def beaten() -> bool:
            made.drives.crew.networks.serve(time.monotonic())
            return made.states() == ["Fault"] * 2

        made.serve_until(beaten)
        assert made.torques() == [0, 0]
        assert any("0x8250" in change["cause"] for change in made.changes)


def test_a_drive_that_missed_the_host_while_it_stood_is_started_without_a_reset() -> None:
    with rig(content(watchdog=0.2)) as made:
        made.tick()
        made.tick()
        made.serve_until(lambda: made.states() == ["Fault"] * 2)
        running(made)


def test_no_heartbeat_leaves_but_in_a_call() -> None:
    with rig(content(heartbeat=0.01)) as made:
        running(made)
        made.bench.serve()
        listener = PolledNetwork("listener", made.settings.bus["s"])
        heard: list[float] = []
        listener.subscribe(0x77F, lambda can_id, data, timestamp: heard.append(timestamp))
        made.serve_until(lambda: len(made.changes) and listener.receive() == 0)
        time.sleep(0.1)
        listener.receive()
        assert heard == []
        made.tick()
        listener.receive()
        listener.disconnect()
        assert len(heard) == 1


def test_a_controller_that_is_off_its_bus() -> None:
    with rig() as made:
        running(made)
        # Error frames come from the host's own controller: no other node sees them.
        bus = made.drives.crew.networks.all[1].bus
        assert isinstance(bus, VirtualBus)
        bus.queue.put(can.Message(is_error_frame=True, arbitration_id=0x04, data=bytes(8)))
        made.tick(*PUSH)
        errors = Layout(made.drives.signals).slices()["bus_errors"]
        assert made.drives.row[errors].tolist() == [0.0, 1.0]
        bus.queue.put(can.Message(is_error_frame=True, arbitration_id=0x40, data=bytes(8)))
        said = made.until_lost(*PUSH)
        assert said == "bus e its controller is off the bus (bus off)"
        made.drives.disable()
        made.serve_until(lambda: made.torques()[0] == 0)
        goes_on_after_a_reset(made)


def test_a_bus_that_breaks_away() -> None:
    with rig() as made:
        running(made)
        bus = made.drives.crew.networks.all[0].bus
        assert bus is not None
        bus.shutdown()
        assert made.until_lost(*PUSH).startswith("bus s cannot receive")
        with pytest.raises(DeviceLost, match="bus s cannot"):
            made.drives.write(np.zeros(2))
        made.drives.disable()
        made.serve_until(lambda: made.torques()[1] == 0)
        goes_on_after_a_reset(made)


def test_a_drive_clips_at_the_limit_of_its_motor() -> None:
    with rig() as made:
        made.enable()
        made.tick(1e4, -1e4)
        assert made.torques() == [1000, -1000]
        made.tick()
        words = made.drives.row[Layout(made.drives.signals).slices()["statusword"]]
        assert [int(word) & LIMITED for word in words] == [LIMITED, LIMITED]
