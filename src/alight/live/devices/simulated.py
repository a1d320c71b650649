"""The simulated testbed: plant and sensors of a closed loop, moved by one sample at each tick."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import casadi as ca
import numpy as np

from alight.kernels.direct import Direct
from alight.kernels.select import Backend
from alight.kernels.stepper import Stepper
from alight.live.devices.device import DeviceLost
from alight.simulation.closed_loop import (
    DIVERGED,
    PLANT,
    PLANT_SIGNALS,
    SENSORS,
    TRIPS,
    ClosedLoop,
    InitialState,
    plain_programs,
)
from alight.symbolic.signals import Signal

DRAWN = 512
"""Noise drawn at a time: a few microseconds, so that no tick is late for it."""
NOW = slice(PLANT.size, PLANT.size + SENSORS.size)


class SimulatedTestbed:
    """A `Device` that is computed: the plant, the sensors and the delay of a closed loop.

    From `enable` on it gives the readings that `alight.simulate` computes from the same torques
    and seed. Before, and after `reset`, the plant stands where a run starts, and its sensors are
    free of noise.

    Parameters
    ----------
    loop : ClosedLoop
        Gives plant, testbed and integrator; its law is not used.
    start : InitialState
        Where a run starts.
    seed : int
        Seed of the sensor noise; every run has the same.
    backend : {"auto", "vm", "c"}
        See `Stepper`.
    """

    signals: Mapping[str, Signal] = PLANT_SIGNALS

    def __init__(
        self, loop: ClosedLoop, start: InitialState, seed: int = 0, backend: Backend = "auto"
    ) -> None:
        sense, move = plain_programs(loop, loop.zeros())
        self._seed = seed
        self._stepper = Stepper(_testbed(loop, sense, move), backend)
        self._stepper.p[:] = loop.parameter_values(loop.zeros())
        self._sense = Direct(sense)
        column = loop.initial_column(start)
        self._begin = np.concatenate([column[: NOW.stop], np.zeros(2)])
        self._now, self._held = self._stepper.x[NOW], self._stepper.x[NOW.stop :]
        self._torque = self._stepper.u[:2]
        self.row = self._stepper.y[:-1]
        self._before, self._opening, self._stands = self._begin[NOW], False, True
        self.reset()

    def read(self, reading: np.ndarray) -> None:
        """Fill in the readings; the first after `enable` are those of one sample before."""
        reading[:] = self._before if self._opening else self._now
        self._opening = False

    def write(self, torque: np.ndarray) -> None:
        """Move the plant by one sample under a torque [N m], unless it stands.

        Raises
        ------
        DeviceLost
            If the plant has left the range in which its numbers mean anything.
        """
        stepper = self._stepper
        self._torque[:] = torque
        if self._stands:
            stepper.step()
            stepper.x[:] = self._begin
            return
        stepper.u[2] = next(self._noise)
        stepper.step()
        if stepper.y[-1]:
            raise DeviceLost(TRIPS[DIVERGED])

    def enable(self) -> None:
        """Let the plant move, and its noise begin."""
        self._noise = _stream(self._seed)
        plant = self._begin[: PLANT.size]
        self._now[:], _ = self._sense(plant, self._before, next(self._noise), self._stepper.p)
        self._opening, self._stands = True, False

    def disable(self) -> None:
        """Take away a torque that is still held back."""
        self._held[:] = 0.0

    def reset(self) -> None:
        """Return to the start and stand there."""
        self._stands, self._opening = True, False
        self._stepper.x[:] = self._begin
        self.write(np.zeros(2))

    def close(self) -> None:
        """Nothing to let go of."""


def _stream(seed: int) -> Iterator[float]:
    """The noise of `alight.simulate`, one number for each sample."""
    generator = np.random.default_rng(seed)
    while True:
        yield from generator.standard_normal(DRAWN).tolist()


def _testbed(loop: ClosedLoop, sense: ca.Function, move: ca.Function) -> ca.Function:
    """A sample of everything but the law, as `Stepper` takes it.

    Torque and the noise of the next reading in; plant, next reading and the torque that a delay
    holds back as state; the signals of the plant and its trip out.
    """
    u, x = ca.MX.sym("u", 3), ca.MX.sym("x", NOW.stop + 2)
    p = ca.MX.sym("p", move.size1_in(2))
    torque, held = u[:2], x[NOW.stop :]
    applied = held if loop.testbed.delay else torque
    following, signals, trip = move(x[: PLANT.size], applied, p)
    now, _ = sense(following, x[NOW], u[2], p)
    x_next, y = ca.vertcat(following, now, torque), ca.vertcat(signals, trip)
    return ca.Function("testbed", [u, x, p], [x_next, y], ["u", "x", "p"], ["x_next", "y"])
