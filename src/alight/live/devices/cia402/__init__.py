"""Real drives: CiA 402 in torque mode over CANopen, by the packages `canopen` and `python-can`."""

from alight.live.devices.cia402.config import DrivesError
from alight.live.devices.cia402.drives import Drives, open_drives

__all__ = ["Drives", "DrivesError", "open_drives"]
