"""All nodes of the bench: brought up, led through their states, and let go together."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Sequence

import can

from alight.live.devices.cia402.config import DrivesSettings, DriveTransducer
from alight.live.devices.cia402.drive import Drive
from alight.live.devices.cia402.emergency import HEARTBEAT_LOST, RPDO_TIMEOUT
from alight.live.devices.cia402.network import Networks, PolledNetwork
from alight.live.devices.cia402.node import OPERATIONAL, Station
from alight.live.devices.cia402.objects import HEARTBEAT, SYNC
from alight.live.devices.cia402.states import Control, State, towards_operation
from alight.live.devices.cia402.transducer import Reading, Transducer
from alight.live.devices.device import DeviceLost

IN_FAULT = (State.FAULT, State.FAULT_REACTION)


class Crew:
    """Drives and transducer with their buses.

    Parameters
    ----------
    settings : DrivesSettings
        The configuration.
    sample_time : float
        Period of SYNC [s].
    limits : sequence of float
        Largest torque at each joint [N m].

    Raises
    ------
    DeviceLost
        If a bus cannot be opened, or a node does not answer or is not what it should be.
    """

    def __init__(
        self, settings: DrivesSettings, sample_time: float, limits: Sequence[float]
    ) -> None:
        self.settings, self.timing = settings, settings.timing
        self._sample_time, self._limits = sample_time, tuple(limits)
        self._sync = can.Message(arbitration_id=SYNC, is_extended_id=False)
        self.networks = Networks([])
        try:
            for name, bus in settings.bus.items():
                self.networks.all += (PolledNetwork(name, bus),)
            self._place()
            self.configure()
        except BaseException:
            self.networks.close()
            raise

    def _place(self) -> None:
        """Make what stands for each node."""
        settings, found = self.settings, {network.name: network for network in self.networks.all}
        position = settings.position
        carrier = position.axis if isinstance(position, DriveTransducer) else 0
        self.drives = tuple(
            Drive(number, axis, found[axis.bus], self.networks, self.timing)
            for number, axis in enumerate(settings.axis, start=1)
        )
        self.stations: tuple[Station, ...] = self.drives
        if isinstance(position, DriveTransducer):
            self.mass = Reading(position, self.drives[carrier - 1], 2)
        else:
            station = Transducer(position, found[position.bus], self.networks, self.timing)
            self.mass = Reading(position, station, 1)
            self.stations += (station,)
        self.sources: tuple[Drive | Reading, ...] = (*self.drives, self.mass)

    def configure(self) -> None:
        """Configure every node, let all exchange PDOs, and make sure that they do.

        Raises
        ------
        DeviceLost
            If a node does not answer or is not what it should be.
        """
        timing, host = self.timing, self.settings.node
        for station in self.stations:
            station.heard = 0.0
            station.identify()
            station.node.nmt.state = "PRE-OPERATIONAL"
        for drive, limit in zip(self.drives, self._limits, strict=True):
            drive.configure(self._sample_time, limit, timing.exchange == "pipelined")
        self.mass.configure()
        for station in self.stations:
            station.watch_one_another(host, self._sample_time)
            station.start()
        self._meet()

    def _meet(self) -> None:
        """Wait for a measurement of each, after which none is still on its way to operation."""
        until = time.monotonic() + self.timing.state
        self.expect()
        self.forgive()
        while late := [source for source in self.sources if not source.fresh]:
            if time.monotonic() > until:
                raise DeviceLost(f"{late[0].name}: sends no measurement on SYNC")
            self._ask()
        for station in self.stations:
            station.nmt = OPERATIONAL

    # Exchange

    def beat(self) -> None:
        """Begin the host's heartbeat, which is sent whenever the buses are served."""
        for network in self.networks.all:
            if not network.tasks:
                can_id = HEARTBEAT + self.settings.node
                network.send_periodic(can_id, [OPERATIONAL], self.timing.heartbeat)

    def sync(self) -> None:
        """Ask every node for its measurement, and have it act on what it was sent.

        Raises
        ------
        DeviceLost
            If a bus does not take it.
        """
        for source in self.sources:
            source.owed += 1
        for network in self.networks.all:
            network.put(self._sync)

    def expect(self) -> None:
        """Take no measurement for a new one that is there already."""
        for source in self.sources:
            source.fresh = False

    def heard_all(self) -> bool:
        """Whether each has answered every `sync`: what came last is no late answer to another."""
        return all(source.fresh and not source.owed for source in self.sources)

    def forgive(self) -> None:
        """Wait no longer for answers that have not come."""
        for source in self.sources:
            source.owed = 0

    def trouble(self, now: float, in_operation: bool) -> str:
        """Why the bench cannot go on, empty if it can."""
        reasons = [network.failure for network in self.networks.all]
        reasons += [station.trouble(now) for station in self.stations]
        if in_operation:
            reasons += [drive.trouble_in_operation() for drive in self.drives]
        return next((reason for reason in reasons if reason), "")

    # States

    def enable(self) -> None:
        """Lead the drives to Operation enabled, at zero torque.

        A drive whose only fault is that it did not hear the host while it stood is acknowledged.

        Raises
        ------
        DeviceLost
            If a drive does not get there in time, or is in a fault.
        """
        self.networks.serve(time.monotonic())
        if trouble := self.trouble(time.monotonic(), in_operation=False):
            raise DeviceLost(trouble)
        self._steer(lambda drive: Control.DISABLE_VOLTAGE)
        if any(_missed_the_host(drive) for drive in self.drives):
            self.acknowledge()
        until = time.monotonic() + self.timing.state
        while waiting := [d for d in self.drives if d.state is not State.ENABLED]:
            for drive in waiting:
                if drive.state in IN_FAULT:
                    raise DeviceLost(f"{drive.name}: is in a fault{drive.because()}; reset it")
            if time.monotonic() > until:
                stuck = waiting[0]
                raise DeviceLost(f"{stuck.name}: stays in {stuck.state.words}{stuck.because()}")
            self._steer(lambda drive: towards_operation(drive.state))
        for drive in self.drives:
            drive.emergency = None

    def acknowledge(self) -> None:
        """Reset faults: the bit of the controlword has to rise for that.

        Raises
        ------
        DeviceLost
            If one does not clear.
        """
        until = time.monotonic() + self.timing.state
        while stuck := [drive for drive in self.drives if drive.state in IN_FAULT]:
            if time.monotonic() > until:
                raise DeviceLost(f"{stuck[0].name}: its fault does not clear{stuck[0].because()}")
            self._steer(lambda drive: Control.DISABLE_VOLTAGE)
            self._steer(_reset_of)
        for drive in self.drives:
            drive.emergency = None

    def _steer(self, control: Callable[[Drive], Control]) -> None:
        """Send each drive a controlword with no torque, and wait for what it says to it."""
        for drive in self.drives:
            drive.send(control(drive))
        self.expect()
        self._ask()

    def _ask(self) -> None:
        """Send SYNC, and wait for what each says to it."""
        self.sync()
        if not self.networks.wait(self.heard_all, self.timing.answer):
            self.forgive()

    def disable(self) -> None:
        """Zero torque at once: quick stop, then the power stage off. Never raises."""
        for control in (Control.QUICK_STOP, Control.DISABLE_VOLTAGE):
            for drive in self.drives:
                with contextlib.suppress(DeviceLost):
                    drive.send(control)
            for network in self.networks.all:
                with contextlib.suppress(DeviceLost):
                    network.put(self._sync)

    def reopen(self) -> None:
        """Open what has failed.

        Raises
        ------
        DeviceLost
            If it cannot be opened.
        """
        for network in self.networks.all:
            network.reopen()

    def close(self) -> None:
        """Zero torque, watchdogs ended in order, nodes stopped, buses closed. Never raises."""
        self.disable()
        now = time.monotonic()
        for station in self.stations:
            if not station.network.failure and not station.trouble(now):
                with contextlib.suppress(DeviceLost):
                    station.forget_host()
            with contextlib.suppress(DeviceLost):
                station.node.nmt.state = "STOPPED"
        self.networks.close()


def _missed_the_host(drive: Drive) -> bool:
    known = drive.emergency.code if drive.emergency is not None else 0
    return drive.state is State.FAULT and known in (HEARTBEAT_LOST, RPDO_TIMEOUT)


def _reset_of(drive: Drive) -> Control:
    return Control.FAULT_RESET if drive.state is State.FAULT else Control.DISABLE_VOLTAGE
