"""What stands between plant and law, Section V: sampling, sensors, motors."""

from alight.testbed.motors import Motors
from alight.testbed.sensors import Encoder, Probe, SensorState, Transducer
from alight.testbed.testbed import Testbed

__all__ = ["Encoder", "Motors", "Probe", "SensorState", "Testbed", "Transducer"]
