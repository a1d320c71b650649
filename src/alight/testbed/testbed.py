"""Sensors, motors and clock as one."""

from __future__ import annotations

from typing import Annotated

from alight.control.measurement import Measurement
from alight.models import PlantState
from alight.symbolic.ops import Scalar
from alight.symbolic.parameters import Positive, Quantity, parameters
from alight.testbed.motors import Motors
from alight.testbed.sensors import Encoder, Probe, SensorState, Transducer


@parameters
class Testbed:
    """What stands between plant and law: sample rate, sensors, motors, computation delay."""

    __test__ = False  # its name starts like a test class

    sample_rate: Annotated[Positive, Quantity("Hz", "rate of the law, with zero-order hold")] = (
        2000.0
    )
    encoder: Encoder = Encoder()
    transducer: Transducer = Transducer()
    probe: Probe = Probe()
    motors: Motors = Motors()
    delay: Annotated[bool, Quantity("", "hold each torque back by one sample")] = False

    def readings(self, s: PlantState, standard_noise: Scalar) -> SensorState:
        """What the sensors show now."""
        return SensorState(self.encoder.read(s.q), self.transducer.read(s.x_m, standard_noise))

    def measure(self, now: SensorState, before: SensorState) -> Measurement:
        """Positions as read, velocities by backward difference."""
        return Measurement(
            q=now.q,
            q_dot=(now.q - before.q) * self.sample_rate,
            x_m=now.x_m,
            x_m_dot=(now.x_m - before.x_m) * self.sample_rate,
        )
