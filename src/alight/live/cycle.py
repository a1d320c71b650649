"""One cycle of the bench, without clock and shared memory: states, commands, law, device, trips."""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping

import numpy as np

from alight.control.law import Law
from alight.control.transition import ContactTransitionLaw
from alight.errors import AlightError
from alight.kernels.select import Backend
from alight.live.bank import Bank
from alight.live.columns import telemetry_layout
from alight.live.devices import Device, DeviceLost
from alight.live.seat import LIMIT, NOT_FINITE, Seat
from alight.live.shared.commands import Command, Kind
from alight.live.shared.status import State
from alight.simulation.closed_loop import PLANT, SENSORS
from alight.symbolic.signals import Layout
from alight.testbed import SensorState

DEVICE_LOST, DEADLINES = 203, 204
HOST_TRIPS = {
    NOT_FINITE: "a signal is infinite or not a number",
    LIMIT: "a signal left its limits",
    DEVICE_LOST: "the device is lost",
    DEADLINES: "too many deadlines were missed",
}
"""What the codes mean of the trips that are the host's own."""
LONGEST_KICK = 10.0
"""Longest time [s] for which a kick may push."""
_HEAD = struct.Struct("9d")
"""The columns ``t`` to ``command``."""


class Refused(AlightError):
    """A command that does not fit the state of the bench, or asks for what there is not."""


class Cycle:
    """A bench that is driven tick by tick: by the host's clock, or by a recording.

    In every state the device is read and written, the law computes, and a row is filled; but a
    torque reaches the device while `state` is RUNNING only. In the other states the law's state
    stays what it was: at its start while READY.

    Parameters
    ----------
    bank : Bank
        The laws; the first one is in force at the beginning.
    device : Device
        What is driven.
    backend : {"auto", "vm", "c"}
        See `alight.kernels.stepper.Stepper`.

    Attributes
    ----------
    layout : Layout
        What a row of telemetry holds.
    state : State
        What goes on now.
    code, reason
        Code of the trip, 0 without one, and why in words.
    law : int
        Number of the law in force.
    command : int
        Number of the last command dealt with; rows carry it.
    ticks : int
        Ticks since the run began; stands still while READY.

    Raises
    ------
    AlightError
        If the scenario limits a signal that no row has.
    """

    def __init__(self, bank: Bank, device: Device, backend: Backend = "auto") -> None:
        self._bank, self._device = bank, device
        self.layout = telemetry_layout(bank, device.signals)
        _refuse_unseen(bank, self.layout)
        numbers = range(len(bank.loops))
        self._seats = [Seat(bank, n, self.layout, device.signals, backend) for n in numbers]
        self._dt, self._motors = bank.loops[0].dt, bank.scenario.testbed.motors
        self._row = np.zeros(self.layout.size)
        self._head = memoryview(self._row)  # type: ignore[arg-type]
        places = self.layout.slices()
        self._torque, self._kick = self._row[places["torque"]], self._row[places["kick"]]
        told = [places[name] for name in device.signals]
        self._told = self._row[told[0].start : told[-1].stop]
        self._laws = self._row[places["torque"].stop :]
        self._asked, self._pushes = np.zeros(2), 0
        self.state, self.code, self.reason = State.READY, 0, ""
        self.ticks, self.command = 0, 0
        self._sit(0)

    # Between two ticks

    def apply(self, command: Command) -> str:
        """Deal with a command, as a whole or not at all.

        Returns
        -------
        str
            Why it was refused; empty if it was applied.
        """
        self.command = command.number
        try:
            _ACTIONS[command.kind](self, command)
        except AlightError as error:
            return str(error)
        return ""

    def trip(self, code: int, reason: str) -> None:
        """Take the torque away, from now on until a reset."""
        if self.state is not State.TRIPPED:
            self._end(State.TRIPPED)
            self.code, self.reason = code, reason

    def stop(self) -> None:
        """Take the torque away if there is any."""
        if self.state is State.RUNNING:
            self._end(State.STOPPED)

    def _end(self, state: State) -> None:
        self.state, self._pushes = state, 0
        self._device.disable()

    def _on_start(self, command: Command) -> None:
        if self.state is not State.READY:
            raise Refused(f"the bench is {self.state.name}: reset it first")
        before = np.empty(SENSORS.size)
        try:
            self._device.enable()
            self._device.read(before)
        except DeviceLost:
            self._device.disable()
            raise
        self._seat.controller.reset(SensorState(**SENSORS.unpack(before)))
        self.state, self.ticks = State.RUNNING, 0

    def _on_stop(self, command: Command) -> None:
        self.stop()

    def _on_reset(self, command: Command) -> None:
        if self.state is State.RUNNING:
            raise Refused("the bench is RUNNING: stop it first")
        self._device.reset()
        self._seat.controller.reset()
        self.state, self.code, self.reason, self.ticks = State.READY, 0, "", 0

    def _on_kick(self, command: Command) -> None:
        if self.state is not State.RUNNING:
            raise Refused(f"the bench is {self.state.name}: a kick needs a run")
        if len(command.values) != 3 or not np.isfinite(command.values).all():
            raise Refused("a kick takes three finite numbers: torque at either joint, duration")
        duration = float(command.values[2])
        if not 0 < duration <= LONGEST_KICK:
            raise Refused(f"duration = {duration:g} s: must be above 0, at most {LONGEST_KICK:g}")
        self._asked[:] = command.values[:2]
        self._pushes = max(round(duration / self._dt), 1)

    def _on_parameters(self, command: Command) -> None:
        if command.law != self.law:
            raise Refused(f"law number {command.law} is not in force")
        self._take(self._seat, command.values)

    def _on_law(self, command: Command) -> None:
        if command.law >= len(self._seats):
            raise Refused(f"law number {command.law}: there are {len(self._seats)} laws")
        old, new = self._seat, self._seats[command.law]
        self._take(new, command.values)
        if new is not old:
            self._sit(command.law)
            new.succeed(old)
        if self.state is State.READY:
            new.restart()

    def _take(self, seat: Seat, column: np.ndarray) -> None:
        """Put parameters in force, once all of them have been found good."""
        loop = seat.column.changed(column)
        _refuse_unreachable(self._bank, loop.law)
        seat.take(loop, column)
        if self.state is State.READY:
            seat.restart()

    def _sit(self, number: int) -> None:
        self.law, self._seat = number, self._seats[number]
        self._laws[:] = np.nan  # what the other law left, and this one does not have

    # A tick

    def tick(
        self,
        row: np.ndarray,
        wall: float = 0.0,
        late: float = 0.0,
        busy: float = 0.0,
        missed: float = 0.0,
    ) -> None:
        """Read, compute, write, and fill in a row of telemetry.

        A signal that is no number or left its limits is seen when the row is whole: the torque of
        that tick has been sent, and is the last one. Every other trip takes away the torque of
        its own tick.

        Parameters
        ----------
        row : (n,) array
            To be filled, in the order of ``layout``.
        wall, late, busy, missed : float
            What a clock knows; see `alight.live.columns.HOST_SIGNALS`.
        """
        seat, device, own = self._seat, self._device, self._row
        try:
            device.read(seat.reading)
        except DeviceLost as error:
            self.trip(DEVICE_LOST, str(error))
        seat.step()
        self._drive(seat)
        try:
            device.write(self._torque)
        except DeviceLost as error:
            self.trip(DEVICE_LOST, str(error))
            self._drive(seat)
        if self.state is not State.RUNNING:
            seat.hold()
        t = self.ticks * self._dt
        state, code, law = float(self.state), self.code, self.law
        _HEAD.pack_into(self._head, 0, t, wall, late, busy, missed, state, code, law, self.command)
        self._told[:] = device.row
        seat.fill(own, device.row[: PLANT.size])
        row[:] = own
        if self.state is not State.READY:
            self.ticks += 1
        if self.state is State.RUNNING and (problem := seat.problem(own)):
            self.trip(*problem)

    def _drive(self, seat: Seat) -> None:
        """Torque and kick of this tick."""
        if self.state is State.RUNNING and seat.controller.trip:
            self.trip(seat.controller.trip, seat.controller.reason)
        if self.state is not State.RUNNING:
            self._torque[:] = self._kick[:] = 0.0
        elif self._pushes:
            self._pushes -= 1
            self._kick[:] = self._asked
            self._torque[:] = self._motors.clip(seat.torque + self._asked)
        else:
            self._kick[:] = 0.0
            self._torque[:] = seat.torque


_ACTIONS: Mapping[Kind, Callable[[Cycle, Command], None]] = {
    Kind.START: Cycle._on_start,
    Kind.STOP: Cycle._on_stop,
    Kind.RESET: Cycle._on_reset,
    Kind.KICK: Cycle._on_kick,
    Kind.PARAMETERS: Cycle._on_parameters,
    Kind.LAW: Cycle._on_law,
}


def _refuse_unseen(bank: Bank, layout: Layout) -> None:
    """Refuse a limit that could never trip."""
    unseen = [name for name in bank.scenario.document.limits if name not in layout.signals]
    if unseen:
        names = ", ".join(f"limits.{name}" for name in unseen)
        raise AlightError(f"{bank.scenario.name}: {names}: the live bench has no such signal")


def _refuse_unreachable(bank: Bank, law: Law) -> None:
    """Refuse a target that the arm cannot reach."""
    if isinstance(law, ContactTransitionLaw):
        point = (law.target.x_md, law.target.x_rd2)
        bank.scenario.plant.arm.inverse(point, bank.scenario.document.start.elbow)
