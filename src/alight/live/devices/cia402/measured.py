"""The plant's signals as far as measurement tells them, under the names of the simulation."""

from __future__ import annotations

import casadi as ca
import numpy as np

from alight.kernels.select import Backend
from alight.kernels.stepper import Stepper
from alight.models import PlantState
from alight.simulation.closed_loop import PLANT_SIGNALS, SENSORS, ClosedLoop, plant_signals
from alight.symbolic.build import build
from alight.symbolic.parameters import lift, values_of
from alight.symbolic.signals import Layout
from alight.testbed import SensorState

LAYOUT = Layout(PLANT_SIGNALS)


class MeasuredPlant:
    """Every signal of the plant, computed from readings by the scenario's model.

    Angles and position are as read, rates by backward difference; the contact force is that of
    the model at the measured gap. The deflection of the friction bristle and with it the friction
    force cannot be measured: they stay zero.

    Parameters
    ----------
    loop : ClosedLoop
        Gives the model and the sample rate.
    backend : {"auto", "vm", "c"}
        See `Stepper`.

    Attributes
    ----------
    reading : (3,) array
        Joint angles [rad] and position of the mass [m]. Fill it.
    torque : (2,) array
        Torque sent to the motors [N m]. Fill it.
    signals : array
        `PLANT_SIGNALS` as one column, renewed by `step`.
    step : callable
        Advance by one sample.
    """

    def __init__(self, loop: ClosedLoop, backend: Backend = "auto") -> None:
        self._stepper = Stepper(_measured(loop), backend)
        self._stepper.p[:] = np.concatenate([values_of(loop.plant), values_of(loop.testbed)])
        self.reading, self.torque = np.split(self._stepper.u, [SENSORS.size])
        self.signals = self._stepper.y
        self.step = self._stepper.step

    def begin(self, reading: np.ndarray) -> None:
        """Start at rest at a reading."""
        self._stepper.x[:] = reading


def _measured(loop: ClosedLoop) -> ca.Function:
    plant, testbed = lift(loop.plant, "plant."), lift(loop.testbed, "testbed.")
    symbolic = ClosedLoop(plant.obj, testbed.obj, loop.law, loop.substeps)
    u, before = ca.SX.sym("u", SENSORS.size + 2), ca.SX.sym("before", SENSORS.size)
    p = ca.vertcat(plant.symbols, testbed.symbols)
    now = SensorState(**SENSORS.unpack(u[: SENSORS.size]))
    measured = testbed.obj.measure(now, SensorState(**SENSORS.unpack(before)))
    state = PlantState(measured.q, measured.q_dot, measured.x_m, measured.x_m_dot, ca.SX(0))
    known = plant_signals(symbolic, state, u[SENSORS.size :])
    y = LAYOUT.pack({**known, "F_t": ca.SX(0)})
    return build("measured", {"u": u, "x": before, "p": p}, {"x_next": u[: SENSORS.size], "y": y})
