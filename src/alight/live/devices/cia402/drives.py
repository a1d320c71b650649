"""The bench's device for real drives: two axes and the transducer of the mass, over CANopen."""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from alight.kernels.select import Backend
from alight.kernels.toolchain import tell_once
from alight.live.devices.cia402.bus_load import check_loads
from alight.live.devices.cia402.config import DrivesSettings, load_drives
from alight.live.devices.cia402.crew import Crew
from alight.live.devices.cia402.measured import LAYOUT, MeasuredPlant
from alight.live.devices.cia402.states import Control
from alight.live.devices.device import DeviceLost
from alight.scenarios import Scenario
from alight.simulation.closed_loop import PLANT_SIGNALS
from alight.symbolic.signals import Layout, Signal

IDLE_SHARE = 0.8
"""Before a run no exchange follows another sooner than this share of a tick."""
OWN_SIGNALS = {
    "statusword": Signal("", "statusword of each drive, CiA 402", 2),
    "torque_actual": Signal("N m", "torque at the joints that the drives report", 2),
    "bus_errors": Signal("", "error frames and senseless messages on the bus of each drive", 2),
    "silence": Signal("", "ticks without a measurement of each axis, and of the mass", 3),
}
OWN = Layout(OWN_SIGNALS)


def open_drives(path: Path, scenario: Scenario) -> Drives:
    """Open the drives of a configuration for a scenario.

    Parameters
    ----------
    path : Path
        The drives file.
    scenario : Scenario
        Gives sample rate, motor limits and the model by which signals are computed.

    Raises
    ------
    DrivesError
        If the configuration is refused, or a bus cannot carry what the sample rate asks for.
    DeviceLost
        If a bus cannot be opened, or a node does not answer or is not what it should be.
    """
    settings = load_drives(path)
    for line in check_loads(settings, scenario.testbed.sample_rate, path):
        tell_once(line)
    return Drives(settings, scenario)


class Drives:
    """Two drives in torque mode and a transducer, as a `Device`.

    All that passes over the buses does so within calls of these methods, in the thread that
    calls them: when it stops, so does the host's heartbeat, and the drives go to their safe state
    by their watchdogs. `reset` moves nothing: the arm is brought back to its start by hand.

    Parameters
    ----------
    settings : DrivesSettings
        The configuration.
    scenario : Scenario
        See `open_drives`.
    backend : {"auto", "vm", "c"}
        See `alight.kernels.stepper.Stepper`.

    Raises
    ------
    DeviceLost
        See `open_drives`.
    """

    signals: Mapping[str, Signal] = {**PLANT_SIGNALS, **OWN_SIGNALS}

    def __init__(
        self, settings: DrivesSettings, scenario: Scenario, backend: Backend = "auto"
    ) -> None:
        loop = scenario.closed_loop
        self._plant = MeasuredPlant(loop, backend)
        self.row = np.zeros(LAYOUT.size + OWN.size)
        self._shown, self._own = np.split(self.row, [LAYOUT.size])
        self._dt, self._timing = loop.dt, settings.timing
        self._fresh = settings.timing.exchange == "fresh"
        bound = loop.testbed.motors.clip(np.full(2, np.inf))
        self.crew = Crew(settings, loop.dt, [float(limit) for limit in bound])
        """The nodes and their buses."""
        self._enabled, self._lost = False, ""
        self._last = 0.0  # when the last exchange was
        self._asked = False  # whether it awaits its answer
        self._silence = [0] * len(self.crew.sources)
        self._begin()

    def _begin(self) -> None:
        """Start from the newest measurement, at rest."""
        self._asked = False
        self._silence = [0] * len(self.crew.sources)
        self._take(time.monotonic())
        self._plant.begin(self._plant.reading)

    # Around a run

    def enable(self) -> None:
        """Lead both drives to Operation enabled, at zero torque.

        A drive that took the host for dead while it stood still is acknowledged; any other fault
        wants `reset`.

        Raises
        ------
        DeviceLost
            If a drive does not get there in time, or is in a fault.
        """
        self.crew.beat()
        self.crew.enable()
        self._begin()
        self._lost, self._enabled = "", True

    def disable(self) -> None:
        """Zero torque at once: quick stop, then the power stage off. Encoders go on sending."""
        self._enabled = False
        self.crew.disable()

    def reset(self) -> None:
        """Configure all nodes anew and acknowledge faults; moves nothing.

        Raises
        ------
        DeviceLost
            If a node does not answer, or a fault does not clear.
        """
        self._enabled = False
        self.crew.reopen()
        self.crew.beat()
        self.crew.configure()
        self.crew.acknowledge()
        self._begin()
        self._lost = ""

    def close(self) -> None:
        """Bring to the safe state and let go of the buses. Never raises."""
        self._enabled = False
        self.crew.close()

    # In a tick

    def read(self, reading: np.ndarray) -> None:
        """Fill in the newest measurement; see `Device`.

        Raises
        ------
        DeviceLost
            If a bus fails, a node has fallen silent or reports an emergency, or a drive has left
            Operation enabled during a run. It is raised again until `reset`.
        """
        crew, now = self.crew, time.monotonic()
        crew.beat()
        try:
            crew.networks.serve(now)
            if self._fresh and self._due(now):
                self._fetch(now)
        except DeviceLost as error:
            self._lost = self._lost or str(error)
        self._take(now)
        reading[:] = self._plant.reading
        self._lost = self._lost or crew.trouble(now, self._enabled) or self._missing()
        if self._lost:
            raise DeviceLost(self._lost)

    def write(self, torque: np.ndarray) -> None:
        """Send the torques, and the power stage off unless enabled; see `Device`.

        Raises
        ------
        DeviceLost
            If a bus does not take them.
        """
        crew, now = self.crew, time.monotonic()
        sent = torque.tolist() if self._enabled else [0.0, 0.0]
        control = Control.ENABLE_OPERATION if self._enabled else Control.DISABLE_VOLTAGE
        try:
            if self._due(now):
                for drive, value in zip(crew.drives, sent, strict=True):
                    drive.send(control, value)
                if not self._fresh:
                    self._exchange(now)
        except DeviceLost as error:
            self._lost = self._lost or str(error)
            raise
        finally:
            self._show(sent)

    def _due(self, now: float) -> bool:
        """Whether an exchange is wanted: in a run always; else after the answer, at most at rate.

        A host that warms up ticks faster than any bus.
        """
        waited = now - self._last >= IDLE_SHARE * self._dt
        return self._enabled or (waited and not self._asked)

    def _exchange(self, now: float) -> None:
        self.crew.expect()
        self.crew.sync()
        self._last, self._asked = now, True

    def _fetch(self, now: float) -> None:
        """Ask for a measurement, and in a run wait for it."""
        self._exchange(now)
        if self._enabled:
            wait = self._timing.fresh_wait * self._dt
            self.crew.networks.wait(self.crew.heard_all, wait)

    def _take(self, now: float) -> None:
        """Take over what was measured, and count what was not.

        In a run each tick has its answer or has none; else an answer has as long as a heartbeat.
        """
        crew, reading = self.crew, self._plant.reading
        first, second = crew.drives
        reading[0], reading[1], reading[2] = first.angle, second.angle, crew.mass.position
        if not self._asked:
            return
        late = now - self._last > self._timing.watchdog
        for number, source in enumerate(crew.sources):
            if source.fresh and not (self._fresh and source.owed):
                self._silence[number] = 0
            elif self._enabled:
                self._silence[number] += 1
            elif late:
                self._silence[number] = self._timing.missing + 1
        if late or max(self._silence) >= self._timing.missing:
            crew.forgive()  # an answer was lost, and the next is not to be taken for it
        self._asked = not (self._enabled or late or crew.heard_all())

    def _missing(self) -> str:
        most = max(self._silence)
        if most <= self._timing.missing:
            return ""
        name = self.crew.sources[self._silence.index(most)].name
        return f"{name}: no measurement for {most} ticks"

    def _show(self, torque: list[float]) -> None:
        """Renew the row."""
        first, second = self.crew.drives
        self._plant.torque[:] = torque
        self._plant.step()
        self._shown[:] = self._plant.signals
        self._own[:] = (
            first.statusword,
            second.statusword,
            first.torque_scale.to_torque(first.torque),
            second.torque_scale.to_torque(second.torque),
            first.network.errors,
            second.network.errors,
            *self._silence,
        )
