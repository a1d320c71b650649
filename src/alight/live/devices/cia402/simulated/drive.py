"""A simulated drive of CiA 402 in torque mode."""

from __future__ import annotations

import time
from collections.abc import Callable

from alight.live.devices.cia402.emergency import HEARTBEAT_LOST, RPDO_TIMEOUT, in_words
from alight.live.devices.cia402.network import PolledNetwork
from alight.live.devices.cia402.objects import (
    CONTROLWORD,
    ENCODER_RESOLUTION,
    ERROR_CODE,
    MODE,
    MODE_SHOWN,
    MOST_TORQUE,
    POSITION,
    QUICK_STOP_OPTION,
    RATED_TORQUE,
    STATUSWORD,
    SUPPORTED_MODES,
    TARGET_TORQUE,
    TORQUE,
    Dictionary,
    Mode,
)
from alight.live.devices.cia402.simulated.node import SimulatedNode
from alight.live.devices.cia402.states import (
    FOLLOWS,
    LIMITED,
    REMOTE,
    TRANSITIONS,
    VOLTAGE,
    Control,
    State,
    command_of,
)

ENDS_BY_ITSELF = (0, 1, 2, 3, 4)
"""Quick stop option codes after which a drive goes on to Switch on disabled."""
RESET_BIT = Control.FAULT_RESET
TORQUE_MODES = {int(mode) for mode in Mode}


class SimulatedDrive(SimulatedNode):
    """A drive: state machine, watchdogs, emergencies; its torque acts on a plant elsewhere.

    Parameters
    ----------
    number, network, objects
        See `SimulatedNode`.
    rated_torque : float
        Rated torque of its motor [N m].
    increments : float
        Increments in a turn of its motor.
    tell : callable
        Told of each change: state, torque in per mille, cause.
    """

    def __init__(
        self,
        number: int,
        network: PolledNetwork,
        objects: Dictionary,
        rated_torque: float,
        increments: float,
        tell: Callable[[SimulatedDrive, str], None],
    ) -> None:
        self._rated, self._increments, self._tell = rated_torque, increments, tell
        self.state = State.NOT_READY
        self.torque = 0
        """Torque that acts now, in per mille of the rated torque."""
        self.position = 0
        """What its encoder shows."""
        self._pending: tuple[int, int] | None = None
        self._control, self._addressed = 0, 0.0
        super().__init__(number, network, objects)

    def booted(self) -> None:
        """Set its ratings, and go to Switch on disabled."""
        self.put(RATED_TORQUE, round(1000 * self._rated))
        self.put(ENCODER_RESOLUTION, round(self._increments), 1)
        self.put(SUPPORTED_MODES, sum(1 << mode - 1 for mode in Mode))
        self._pending, self._control, self._addressed = None, 0, 0.0
        self.put(ERROR_CODE, 0)
        self.put(MODE_SHOWN, 0)
        self._go(State.SWITCH_ON_DISABLED, "boot-up")

    # What it is told

    def written(self, index: int, value: int) -> None:
        """Obey what comes by SDO."""
        if index == MODE and value in TORQUE_MODES:
            self.put(MODE_SHOWN, value)
        elif index == CONTROLWORD:
            self._obey(value & 0xFFFF)

    def addressed(self, values: dict[tuple[int, int], int], at_once: bool) -> None:
        """Take controlword and target torque: at once, or with the next SYNC."""
        self._addressed = time.monotonic()
        self._pending = values[CONTROLWORD, 0], values[TARGET_TORQUE, 0]
        if at_once:
            self._act()

    def synchronised(self) -> None:
        """Act on what was sent before, and show what there is."""
        self._act()
        self.put(POSITION, self.position)
        self.put(TORQUE, self.torque)
        self.put(STATUSWORD, self.statusword)

    @property
    def statusword(self) -> int:
        """What it says of itself."""
        word = self.state.value[1] | REMOTE
        if self.state in (State.SWITCHED_ON, State.ENABLED, State.QUICK_STOP):
            word |= VOLTAGE
        if self.state is State.ENABLED:
            word |= FOLLOWS
            word |= LIMITED if abs(self.torque) >= self.value(MOST_TORQUE) else 0
        return word

    def _act(self) -> None:
        if self._pending is None:
            return
        control, target = self._pending
        self._pending = None
        self._obey(control)
        if self.state is State.ENABLED and self.value(MODE_SHOWN) in TORQUE_MODES:
            most = self.value(MOST_TORQUE)
            self.torque = min(max(target, -most), most)
        else:
            self.torque = 0

    def _obey(self, control: int) -> None:
        rises = control & RESET_BIT and not self._control & RESET_BIT
        self._control = control
        if self.state is State.FAULT:
            if rises:
                self.put(ERROR_CODE, 0)
                self.node.emcy.reset()
                self._go(State.SWITCH_ON_DISABLED, "fault reset")
            return
        if self.state is State.QUICK_STOP and self.value(QUICK_STOP_OPTION) in ENDS_BY_ITSELF:
            self._go(State.SWITCH_ON_DISABLED, "quick stop ended")
            return
        following = TRANSITIONS.get((self.state, command_of(control)))
        if following is not None:
            self._go(following, f"controlword 0x{control:04X}")

    def _go(self, state: State, cause: str) -> None:
        if state is not State.ENABLED:
            self.torque = 0
        self.state = state
        self._tell(self, cause)

    # Faults

    def fault(self, code: int, detail: str = "") -> None:
        """Run into a fault: torque zero, an emergency message, then Fault."""
        self._go(State.FAULT_REACTION, f"{in_words(code)} {detail}".strip())
        self.put(ERROR_CODE, code)
        if self.plugged:
            self.node.emcy.send(code, 1)
        self._go(State.FAULT, in_words(code))

    def watch(self, now: float) -> None:
        """Go into a fault if the host has fallen silent."""
        if self.state in (State.FAULT, State.FAULT_REACTION):
            return
        if silent := self.host_silent(now):
            self._heard = 0.0
            self.fault(HEARTBEAT_LOST, f"for {silent:.3f} s")
        elif self._late(now) and self.state is State.ENABLED:
            self.fault(RPDO_TIMEOUT, f"for {now - self._addressed:.3f} s")

    def _late(self, now: float) -> bool:
        most = self.value(0x1400, 5) / 1000.0
        return bool(most) and now - self._addressed > most
