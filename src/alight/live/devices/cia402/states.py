"""The state machine of CiA 402: what a drive is in, and which controlword leads on."""

from __future__ import annotations

from enum import Enum, IntEnum


class State(Enum):
    """State of a drive; the value is what its statusword shows: mask, and bits under it."""

    NOT_READY = (0x4F, 0x00)
    SWITCH_ON_DISABLED = (0x4F, 0x40)
    READY = (0x6F, 0x21)
    SWITCHED_ON = (0x6F, 0x23)
    ENABLED = (0x6F, 0x27)
    QUICK_STOP = (0x6F, 0x07)
    FAULT_REACTION = (0x4F, 0x0F)
    FAULT = (0x4F, 0x08)

    @property
    def words(self) -> str:
        """Its name in CiA 402."""
        return NAMES[self]


NAMES = {
    State.NOT_READY: "Not ready to switch on",
    State.SWITCH_ON_DISABLED: "Switch on disabled",
    State.READY: "Ready to switch on",
    State.SWITCHED_ON: "Switched on",
    State.ENABLED: "Operation enabled",
    State.QUICK_STOP: "Quick stop active",
    State.FAULT_REACTION: "Fault reaction active",
    State.FAULT: "Fault",
}


class Control(IntEnum):
    """Controlwords, each with the bits of its command and no others."""

    DISABLE_VOLTAGE = 0x00
    QUICK_STOP = 0x02
    SHUTDOWN = 0x06
    SWITCH_ON = 0x07
    """Also "disable operation", where operation is enabled."""
    ENABLE_OPERATION = 0x0F
    FAULT_RESET = 0x80
    """Acts when its bit rises."""


VOLTAGE = 0x0010
"""Bit of the statusword: the power stage is supplied."""
REMOTE = 0x0200
"""Bit of the statusword: the controlword is obeyed."""
LIMITED = 0x0800
"""Bit of the statusword: an internal limit acts."""
FOLLOWS = 0x1000
"""Bit of the statusword in the cyclic modes: the drive follows the command."""


def state_of(statusword: int) -> State:
    """The state that a statusword shows; the bits of no state mean that it is not ready."""
    for state in State:
        mask, bits = state.value
        if statusword & mask == bits:
            return state
    return State.NOT_READY


def command_of(controlword: int) -> Control:
    """The command that a controlword gives; other bits, and its edge for a reset, do not matter."""
    if not controlword & 0x02:
        return Control.DISABLE_VOLTAGE
    if not controlword & 0x04:
        return Control.QUICK_STOP
    if not controlword & 0x01:
        return Control.SHUTDOWN
    return Control.ENABLE_OPERATION if controlword & 0x08 else Control.SWITCH_ON


TRANSITIONS = {
    (State.SWITCH_ON_DISABLED, Control.SHUTDOWN): State.READY,  # 2
    (State.READY, Control.SWITCH_ON): State.SWITCHED_ON,  # 3
    (State.READY, Control.ENABLE_OPERATION): State.SWITCHED_ON,  # 3, and 4 with the next
    (State.SWITCHED_ON, Control.ENABLE_OPERATION): State.ENABLED,  # 4
    (State.ENABLED, Control.SWITCH_ON): State.SWITCHED_ON,  # 5
    (State.SWITCHED_ON, Control.SHUTDOWN): State.READY,  # 6
    (State.READY, Control.QUICK_STOP): State.SWITCH_ON_DISABLED,  # 7
    (State.READY, Control.DISABLE_VOLTAGE): State.SWITCH_ON_DISABLED,  # 7
    (State.ENABLED, Control.SHUTDOWN): State.READY,  # 8
    (State.ENABLED, Control.DISABLE_VOLTAGE): State.SWITCH_ON_DISABLED,  # 9
    (State.SWITCHED_ON, Control.DISABLE_VOLTAGE): State.SWITCH_ON_DISABLED,  # 10
    (State.SWITCHED_ON, Control.QUICK_STOP): State.SWITCH_ON_DISABLED,  # 10
    (State.ENABLED, Control.QUICK_STOP): State.QUICK_STOP,  # 11
    (State.QUICK_STOP, Control.DISABLE_VOLTAGE): State.SWITCH_ON_DISABLED,  # 12
    (State.QUICK_STOP, Control.ENABLE_OPERATION): State.ENABLED,  # 16
}
"""The transitions of CiA 402 that a controlword causes, by their numbers there; any other command
changes nothing. 0, 1, 13 and 14 are the drive's own, 15 is the reset of a fault."""

TOWARDS_OPERATION = {
    State.SWITCH_ON_DISABLED: Control.SHUTDOWN,
    State.READY: Control.SWITCH_ON,
    State.SWITCHED_ON: Control.ENABLE_OPERATION,
    State.ENABLED: Control.ENABLE_OPERATION,
}
"""The controlword that leads on towards operation. In any other state it is that which disables:
a quick stop is to end before a new start, a fault to be reset."""


def towards_operation(state: State) -> Control:
    """The controlword to send to a drive in a state so that operation becomes enabled."""
    return TOWARDS_OPERATION.get(state, Control.DISABLE_VOLTAGE)
