"""What a controller is: a sampled-data system, measurement and state in, torque and state out."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar, NamedTuple

from alight.control.measurement import Measurement
from alight.symbolic.ops import Scalar, Vector
from alight.symbolic.signals import Signal


class Tick(NamedTuple):
    """What a law gives at a sample."""

    tau: Vector
    """Joint torques [N m], shape (2,)."""
    state: Mapping[str, Any]
    """The law's next state, by name."""
    signals: Mapping[str, Any]
    """Signals to record, by name; their units stand in ``Law.signals``."""
    trip: Scalar = 0.0
    """Nonzero when the law has left its domain: an entry of ``Law.trips``."""


class Law(ABC):
    """A sampled law whose tick is a function of floats, arrays or expressions alike.

    Expressions let Alight compile, differentiate and export the law; use the functions of
    `alight.symbolic.ops` in it, not those of ``math`` or ``numpy``.
    """

    states: ClassVar[Mapping[str, Signal]]
    """The law's state: name, unit and size of each part."""
    signals: ClassVar[Mapping[str, Signal]] = {}
    """The signals that `tick` records."""
    trips: ClassVar[Mapping[int, str]] = {}
    """What each trip code means."""

    @abstractmethod
    def initial_state(self) -> Mapping[str, Any]:
        """State before the first sample, by name."""

    @abstractmethod
    def tick(self, state: Mapping[str, Any], measured: Measurement, dt: Scalar) -> Tick:
        """One sample: torque and next state from the state and what is measured.

        ``dt`` is the sample time [s].
        """


class PlainLaw(Law):
    """A law in ordinary Python: any code on floats and arrays, run in a plain loop.

    It gets simulation, recording and comparison, but no compilation and no export.
    """
