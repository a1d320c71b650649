"""The state machine is that of CiA 402, by the table of an independent implementation."""

from __future__ import annotations

import pytest
from canopen.profiles.p402 import State402
from hypothesis import given
from hypothesis import strategies as st

from alight.live.devices.cia402.states import (
    TRANSITIONS,
    Control,
    State,
    command_of,
    state_of,
    towards_operation,
)

OWN = {
    State.NOT_READY: "NOT READY TO SWITCH ON",
    State.SWITCH_ON_DISABLED: "SWITCH ON DISABLED",
    State.READY: "READY TO SWITCH ON",
    State.SWITCHED_ON: "SWITCHED ON",
    State.ENABLED: "OPERATION ENABLED",
    State.QUICK_STOP: "QUICK STOP ACTIVE",
    State.FAULT_REACTION: "FAULT REACTION ACTIVE",
    State.FAULT: "FAULT",
}
BY_NAME = {name: state for state, name in OWN.items()}
AUTOMATIC = {"START", "NOT READY TO SWITCH ON", "FAULT REACTION ACTIVE", "FAULT"}


@given(st.integers(0, 0xFFFF))
def test_a_statusword_shows_one_state_and_the_same_to_both(word: int) -> None:
    theirs = [name for name, (mask, bits) in State402.SW_MASK.items() if word & mask == bits]
    assert len(theirs) <= 1
    assert state_of(word) is (BY_NAME[theirs[0]] if theirs else State.NOT_READY)


@pytest.mark.parametrize(("before", "after"), State402.TRANSITIONTABLE)
def test_every_commanded_transition_of_the_table_is_there(before: str, after: str) -> None:
    if before in AUTOMATIC:
        return
    word = State402.TRANSITIONTABLE[before, after]
    assert TRANSITIONS[BY_NAME[before], command_of(word)] is BY_NAME[after]


def test_no_transition_goes_beyond_the_table() -> None:
    # 7 and 10 also follow a quick stop; 3 also follows "enable operation", which 4 completes.
    also = {
        (State.READY, State.SWITCH_ON_DISABLED),
        (State.SWITCHED_ON, State.SWITCH_ON_DISABLED),
        (State.READY, State.SWITCHED_ON),
    }
    for (before, command), after in TRANSITIONS.items():
        assert (OWN[before], OWN[after]) in State402.TRANSITIONTABLE, (before, command)
        if (before, after) not in also:
            word = State402.TRANSITIONTABLE[OWN[before], OWN[after]]
            assert command_of(word) is command


@given(st.integers(0, 0xFFFF))
def test_only_four_bits_command(word: int) -> None:
    assert command_of(word) is command_of(word & 0x0F)


@pytest.mark.parametrize("start", [State.SWITCH_ON_DISABLED, State.QUICK_STOP, State.ENABLED])
def test_the_way_to_operation_ends_there(start: State) -> None:
    state, steps = start, 0
    while state is not State.ENABLED:
        state = TRANSITIONS[state, towards_operation(state)]
        steps += 1
    assert steps <= 4


@pytest.mark.parametrize("state", [State.FAULT, State.FAULT_REACTION, State.NOT_READY])
def test_a_fault_is_not_left_by_asking_for_operation(state: State) -> None:
    assert towards_operation(state) is Control.DISABLE_VOLTAGE
