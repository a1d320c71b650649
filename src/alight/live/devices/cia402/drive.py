"""A drive as the host sees it."""

from __future__ import annotations

import struct
import time
from typing import Any

import can

from alight.live.devices.cia402.config import AxisSettings, Timing
from alight.live.devices.cia402.emergency import in_words
from alight.live.devices.cia402.network import Networks, PolledNetwork
from alight.live.devices.cia402.node import Station
from alight.live.devices.cia402.objects import (
    ABORT_CONNECTION,
    CONTROLWORD,
    DRIVES_PROFILE,
    ENCODER_RESOLUTION,
    ERROR_CODE,
    FAULT_OPTION,
    INTERPOLATION_PERIOD,
    MODE,
    MODE_SHOWN,
    MOST_TORQUE,
    POSITION,
    RATED_TORQUE,
    STATUSWORD,
    SUPPORTED_MODES,
    TARGET_TORQUE,
    TORQUE,
    TORQUE_SLOPE,
    Mode,
    drive_objects,
)
from alight.live.devices.cia402.scales import AngleScale, TorqueScale
from alight.live.devices.cia402.states import Control, State, state_of
from alight.live.devices.device import DeviceLost

COMMAND = struct.Struct("<Hh")
"""What a drive is sent: controlword, target torque."""
ANSWER = struct.Struct("<Hih")
"""What it sends: statusword, position, torque."""
MODES = {
    "cyclic-synchronous-torque": Mode.CYCLIC_SYNCHRONOUS_TORQUE,
    "profile-torque": Mode.PROFILE_TORQUE,
}
FASTEST = 0xFFFFFFFF
"""Slope of the profile in torque mode [per mille of rated torque in a second]: none."""


class Drive(Station):
    """A drive of CiA 402 in torque mode.

    Parameters
    ----------
    number : int
        Which axis, from 1.
    settings : AxisSettings
        What the configuration says of it.
    network, networks, timing
        See `Station`.
    """

    profile = DRIVES_PROFILE

    def __init__(
        self,
        number: int,
        settings: AxisSettings,
        network: PolledNetwork,
        networks: Networks,
        timing: Timing,
    ) -> None:
        objects = drive_objects()
        super().__init__(f"axis {number}", settings.node, network, networks, objects, timing)
        self.settings = settings
        self.torque_scale = TorqueScale(1.0)
        self.angle_scale = AngleScale(1.0)
        self.statusword = 0
        self.position = 0
        self.torque = 0
        self.fresh = False
        """Whether a measurement has come since this was last set to False."""
        self.owed = 0
        """Measurements that were asked for and have not come."""
        rpdo = self.node.rpdo[1].predefined_cob_id
        self._command = can.Message(
            arbitration_id=rpdo, data=COMMAND.pack(0, 0), is_extended_id=False
        )

    @property
    def state(self) -> State:
        """State of CiA 402 that it last reported."""
        return state_of(self.statusword)

    @property
    def angle(self) -> float:
        """Angle of the joint that it last reported [rad]."""
        return self.angle_scale.to_angle(self.position)

    def send(self, control: Control, torque: float = 0.0) -> None:
        """Send controlword and joint torque [N m].

        Raises
        ------
        DeviceLost
            If the bus does not take them.
        """
        COMMAND.pack_into(self._command.data, 0, control, self.torque_scale.to_raw(torque))
        self.network.put(self._command)

    def _on_answer(self, can_id: int, data: Any, timestamp: float) -> None:
        if len(data) >= ANSWER.size:
            self.statusword, self.position, self.torque = ANSWER.unpack_from(data)
            self.fresh, self.owed = True, max(self.owed - 1, 0)

    def trouble_in_operation(self) -> str:
        """Why a run cannot go on with it; empty if it can."""
        if self.emergency is not None:
            return f"{self.name}: {self.emergency_text}"
        if self.state is not State.ENABLED:
            return f"{self.name}: left Operation enabled, it is in {self.state.words}"
        return ""

    def because(self) -> str:
        """Why it is in a fault as far as it tells, to be appended to a message."""
        if self.emergency is not None:
            return f": it {self.emergency_text}"
        try:
            code = self.ask(ERROR_CODE)
        except DeviceLost:
            return ""
        return f": its error code is {in_words(code)}" if code else ""

    def configure(self, sample_time: float, limit: float, synchronous: bool) -> None:
        """Make a drive that just has power ready to be enabled.

        Parameters
        ----------
        sample_time : float
            Period of SYNC [s].
        limit : float
            Largest torque at the joint [N m]: the drive clips there, too.
        synchronous : bool
            Whether a target acts with the SYNC that follows it, or at once.

        Raises
        ------
        DeviceLost
            If it does not answer, or has no torque mode.
        """
        for value in self.settings.objects:
            self.tell_raw(value)
        self._choose_mode()
        self._read_scales()
        per_mille = min(int(limit / abs(self.torque_scale.step) + 0.5), 0xFFFF)
        self.tell(MOST_TORQUE, per_mille, needed=False)
        self.tell(ABORT_CONNECTION, 1, needed=False)  # a lost host is a fault
        self.tell(FAULT_OPTION, 0, needed=False)  # in a fault the power stage is off at once
        self._set_period(sample_time)
        self.map_pdo(self.node.rpdo[1], synchronous, (CONTROLWORD, 0), (TARGET_TORQUE, 0))
        self.tell(0x1400, round(1000 * self.timing.watchdog), 5, needed=False)
        self.map_pdo(self.node.tpdo[1], True, (STATUSWORD, 0), (POSITION, 0), (TORQUE, 0))
        self.listen(self.node.tpdo[1], self._on_answer)

    def _choose_mode(self) -> None:
        mode = MODES[self.settings.mode]
        if not self.ask(SUPPORTED_MODES) >> (mode - 1) & 1:
            raise DeviceLost(
                f"{self.name}: has no mode {self.settings.mode!r} ({mode:d}) by object 0x6502"
            )
        self.tell(MODE, mode)
        until = time.monotonic() + self.timing.state
        while (shown := self.ask(MODE_SHOWN)) != mode:
            if time.monotonic() > until:
                raise DeviceLost(
                    f"{self.name}: stays in mode {shown}, not {self.settings.mode!r} ({mode:d})"
                )
        if mode is Mode.PROFILE_TORQUE:
            self.tell(TORQUE_SLOPE, FASTEST)

    def _read_scales(self) -> None:
        axis = self.settings
        rated = axis.rated_torque or self.ask(RATED_TORQUE) / 1000.0
        increments = axis.increments
        if increments is None:
            turns = self.ask(ENCODER_RESOLUTION, 2)
            increments = self.ask(ENCODER_RESOLUTION, 1) / max(turns, 1)
        if rated <= 0 or increments <= 0:
            raise DeviceLost(
                f"{self.name}: its objects 0x6076 and 0x608F say a rated torque of {rated:g} N m "
                f"and {increments:g} increments; give rated_torque and increments"
            )
        self.torque_scale = TorqueScale(rated, axis.gear, axis.direction)
        self.angle_scale = AngleScale(increments, axis.gear, axis.direction, axis.zero)

    def _set_period(self, sample_time: float) -> None:
        """Tell a drive in cyclic mode when targets come: value and power of ten, in seconds."""
        if MODES[self.settings.mode] is not Mode.CYCLIC_SYNCHRONOUS_TORQUE:
            return
        exponent = -3
        while exponent > -6 and abs(sample_time / 10.0**exponent % 1.0) > 1e-9:
            exponent -= 1
        while sample_time / 10.0**exponent > 255.5 and exponent < -1:
            exponent += 1
        self.tell(INTERPOLATION_PERIOD, round(sample_time / 10.0**exponent), 1, needed=False)
        self.tell(INTERPOLATION_PERIOD, exponent & 0xFF, 2, needed=False)
