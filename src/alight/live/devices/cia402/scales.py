"""Between joints in SI units and the whole numbers that stand in messages."""

from __future__ import annotations

from dataclasses import dataclass

TURN = 6.283185307179586
INT16 = 32767


@dataclass(frozen=True)
class TorqueScale:
    """Torque at a joint [N m], as per mille of the rated torque of its motor."""

    rated: float
    """Rated torque of the motor [N m]."""
    gear: float = 1.0
    """Turns of the motor for one of the joint."""
    direction: int = 1
    """-1 where the motor counts against the joint."""

    @property
    def step(self) -> float:
        """What one per mille is at the joint [N m], with the sign of the direction."""
        return self.rated * self.gear * self.direction / 1000.0

    def to_raw(self, torque: float) -> int:
        """The nearest whole number, at the ends of 16 bits if the torque lies beyond them."""
        return min(max(round(torque / self.step), -INT16), INT16)

    def to_torque(self, raw: int) -> float:
        """Torque at the joint [N m]."""
        return raw * self.step


@dataclass(frozen=True)
class AngleScale:
    """Angle of a joint [rad], as increments of the encoder on its motor."""

    increments: float
    """Increments in a turn of the motor."""
    gear: float = 1.0
    direction: int = 1
    zero: float = 0.0
    """Angle of the joint at which the encoder shows zero [rad]."""

    @property
    def step(self) -> float:
        """What one increment is at the joint [rad], with the sign of the direction."""
        return self.direction * TURN / (self.increments * self.gear)

    def to_raw(self, angle: float) -> int:
        """The nearest whole number of increments."""
        return round((angle - self.zero) / self.step)

    def to_angle(self, raw: int) -> float:
        """Angle of the joint [rad]."""
        return raw * self.step + self.zero


@dataclass(frozen=True)
class LengthScale:
    """Position of the mass [m], as steps of its transducer."""

    step: float
    """What one step is [m]; negative where the transducer counts against the axis."""
    offset: float = 0.0
    """Position at which the transducer shows zero [m]."""

    def to_raw(self, position: float) -> int:
        """The nearest whole number of steps."""
        return round((position - self.offset) / self.step)

    def to_position(self, raw: int) -> float:
        """Position of the mass [m]."""
        return raw * self.step + self.offset
