"""A device: two calls in each tick, and what surrounds a run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import numpy as np

from alight.errors import AlightError
from alight.symbolic.signals import Signal


class DeviceLost(AlightError):
    """A device that no longer answers, or reports a fault: the host trips with this reason."""


class Device(Protocol):
    """Motors and sensors. In every tick the host calls `read`, then `write`, and nothing else.

    Neither waits longer than a small part of a tick. The host ticks always: before `enable` and
    after `disable` it writes zeros, so that `row` is renewed and a bus stays awake. The other
    calls stand between two ticks and may take their time; their time is no missed deadline.
    """

    @property
    def signals(self) -> Mapping[str, Signal]:
        """What it has to tell besides the measurement, in the order of `row`."""

    @property
    def row(self) -> np.ndarray:
        """Those signals as one column, renewed by `write`; it keeps its address."""

    def read(self, reading: np.ndarray) -> None:
        """Fill in the joint angles [rad] and the position of the mass [m], shape (3,).

        Raises
        ------
        DeviceLost
            If there is no measurement.
        """

    def write(self, torque: np.ndarray) -> None:
        """Send the joint torques [N m], shape (2,).

        Raises
        ------
        DeviceLost
            If they cannot be sent.
        """

    def enable(self) -> None:
        """Make ready for torques before a run; takes as long as it takes.

        Raises
        ------
        DeviceLost
            If it cannot be made ready; says why.
        """

    def disable(self) -> None:
        """Bring to the safe state: no torque. Never raises."""

    def reset(self) -> None:
        """Return to where a run starts, as far as a device can: faults cleared, plant at rest.

        Raises
        ------
        DeviceLost
            If a fault does not clear.
        """

    def close(self) -> None:
        """Bring to the safe state and let go. Never raises."""
