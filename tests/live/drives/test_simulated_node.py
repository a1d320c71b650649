"""The simulated drive is one of CiA 402, as seen by the drive class of the canopen package."""

from __future__ import annotations

import threading
from collections.abc import Iterator

import pytest
from canopen import Network
from canopen.profiles.p402 import BaseNode402

from alight.live.devices.cia402.objects import drive_objects
from alight.live.devices.cia402.states import TRANSITIONS, Control, State
from tests.live.drives.rig import Rig, content, rig

WAY_TO = {
    State.SWITCH_ON_DISABLED: (),
    State.READY: (Control.SHUTDOWN,),
    State.SWITCHED_ON: (Control.SHUTDOWN, Control.SWITCH_ON),
    State.ENABLED: (Control.SHUTDOWN, Control.SWITCH_ON, Control.ENABLE_OPERATION),
    State.QUICK_STOP: (
        Control.SHUTDOWN,
        Control.SWITCH_ON,
        Control.ENABLE_OPERATION,
        Control.QUICK_STOP,
    ),
}


@pytest.fixture
def made() -> Iterator[Rig]:
    with rig(opened=False) as one:
        yield one


@pytest.fixture
def master(made: Rig) -> Iterator[BaseNode402]:
    """Somebody else's view of the first drive, with that one's threads."""
    with made.served():
        network = Network()
        bus = made.settings.bus["s"]
        network.connect(interface="virtual", channel=bus.channel)
        node = BaseNode402(1, drive_objects())
        network.add_node(node)
        yield node
        network.disconnect()


def test_a_foreign_master_leads_it_to_operation_and_back(made: Rig, master: BaseNode402) -> None:
    drive = made.bench.drives[0]
    for word in (0x06, 0x07, 0x0F):
        master.sdo[0x6040].raw = word
    assert drive.state is State.ENABLED
    assert master.sdo[0x1000].raw == 402
    assert master.sdo[0x6076].raw == 240_000
    assert master.sdo[0x608F][1].raw == 614_400
    master.sdo[0x6040].raw = 0x02
    assert drive.state is State.QUICK_STOP


def test_its_heartbeat_and_emergencies_reach_a_foreign_master(
    made: Rig, master: BaseNode402
) -> None:
    master.sdo[0x1017].raw = 10
    assert master.nmt.wait_for_heartbeat(60) == "PRE-OPERATIONAL"
    master.nmt.state = "OPERATIONAL"
    master.nmt.wait_for_heartbeat(60)
    told = threading.Event()
    master.emcy.add_callback(lambda error: told.set())
    made.bench.drives[0].fault(0x2310)
    assert told.wait(60)
    assert [error.code for error in master.emcy.active] == [0x2310]
    assert master.sdo[0x603F].raw == 0x2310
    master.sdo[0x6040].raw = 0x80
    assert made.bench.drives[0].state is State.SWITCH_ON_DISABLED


@pytest.mark.parametrize("state", list(WAY_TO), ids=lambda state: state.name)
@pytest.mark.parametrize("word", list(Control), ids=lambda word: word.name)
def test_every_command_in_every_state(made: Rig, state: State, word: Control) -> None:
    drive = made.bench.drives[0]
    drive.node.sdo[0x605A].raw = 6  # stays in quick stop until told otherwise
    for step in WAY_TO[state]:
        drive.written(0x6040, step)
    assert drive.state is state
    drive.written(0x6040, word)
    command = Control.DISABLE_VOLTAGE if word is Control.FAULT_RESET else word
    assert drive.state is TRANSITIONS.get((state, command), state)


def test_a_fault_is_left_by_a_rising_edge_alone(made: Rig) -> None:
    drive = made.bench.drives[0]
    for step in (*WAY_TO[State.ENABLED], 0x8F):
        drive.written(0x6040, step)
    drive.fault(0x4310)
    for word in (*Control, 0x8F):
        if not word & 0x80:
            drive.written(0x6040, word)
            assert drive.state is State.FAULT
    drive.written(0x6040, 0x80)
    assert drive.state is State.SWITCH_ON_DISABLED
    drive.fault(0x4310)
    drive.written(0x6040, 0x80)  # it has not fallen in between
    assert drive.state is State.FAULT
    assert [change["state"] for change in made.changes[-2:]] == ["Fault reaction active", "Fault"]


@pytest.mark.parametrize("option", [0, 1, 2, 5, 6])
def test_a_quick_stop_ends_by_itself_or_waits_as_its_option_says(made: Rig, option: int) -> None:
    drive = made.bench.drives[0]
    drive.node.sdo[0x605A].raw = option
    for step in WAY_TO[State.QUICK_STOP]:
        drive.written(0x6040, step)
    drive.written(0x6040, Control.QUICK_STOP)
    ended = option in (0, 1, 2)
    assert drive.state is (State.SWITCH_ON_DISABLED if ended else State.QUICK_STOP)
    assert drive.torque == 0


def test_no_torque_outside_operation_or_in_another_mode() -> None:
    with rig(content()) as made:
        drive = made.bench.drives[0]
        given = {(0x6040, 0): 0x0F, (0x6071, 0): 500}
        drive.addressed(given, at_once=True)
        assert drive.state is not State.ENABLED and drive.torque == 0
        made.enable()
        drive.addressed(given, at_once=True)
        assert drive.torque == 500
        drive.put(0x6061, 1)
        drive.addressed(given, at_once=True)
        assert drive.torque == 0
