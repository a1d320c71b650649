"""Resolvers, displacement transducer and capacitance probe of Section V."""

from __future__ import annotations

from typing import Annotated, Any, NamedTuple

from alight.symbolic.ops import Scalar, floor, where
from alight.symbolic.parameters import NonNegative, Positive, Quantity, parameters
from alight.symbolic.signals import Signal

_TURN = 6.283185307179586


def quantize(value: Any, resolution: Scalar) -> Any:
    """Round to the nearest multiple of ``resolution``; a resolution of 0 changes nothing."""
    fine = resolution + where(resolution > 0, 0.0, 1.0)
    return where(resolution > 0, floor(value / fine + 0.5) * fine, value)


@parameters
class Encoder:
    """A resolver with its converter: joint angles in counts."""

    counts: Annotated[
        NonNegative, Quantity("1/rev", "counts per revolution; 0 for an ideal sensor")
    ] = 614400.0

    def read(self, q: Any) -> Any:
        """Measured joint angles [rad]."""
        ideal = where(self.counts > 0, 0.0, 1.0)
        return quantize(q, (1 - ideal) * _TURN / (self.counts + ideal))


@parameters
class Transducer:
    """The displacement transducer of the mass (item 2 of Fig. 2)."""

    resolution: Annotated[NonNegative, Quantity("m", "smallest step; 0 for an ideal sensor")] = 0.0
    noise: Annotated[NonNegative, Quantity("m", "standard deviation of the noise")] = 0.0

    def read(self, x_m: Scalar, standard_noise: Scalar) -> Scalar:
        """Measured position of the mass [m]; ``standard_noise`` has unit variance."""
        return quantize(x_m + self.noise * standard_noise, self.resolution)


@parameters
class Probe:
    """The capacitance probe (item 3 of Fig. 2): it watches the stiff spring and steers nothing."""

    clearance: Annotated[
        Positive, Quantity("m", "deflection of the stiff spring at which its plate is touched")
    ] = 2e-3


class SensorState(NamedTuple):
    """What the backward differences remember: the previous readings."""

    q: Annotated[Any, Signal("rad", "previous reading of the joint angles", 2)]
    x_m: Annotated[Any, Signal("m", "previous reading of the position of the mass")]
