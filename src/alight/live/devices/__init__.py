"""What the host drives: a simulated testbed, or real motors and sensors."""

from alight.live.devices.device import Device, DeviceLost

__all__ = ["Device", "DeviceLost"]
