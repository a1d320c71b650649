"""Emergency messages in words."""

from __future__ import annotations

from canopen.emcy import EmcyError

HEARTBEAT_LOST = 0x8130
RPDO_TIMEOUT = 0x8250

WORDS = {
    0x2220: "continuous overcurrent inside the drive",
    0x2230: "short circuit or earth leakage inside the drive",
    0x2310: "continuous overcurrent at the output",
    0x2320: "short circuit or earth leakage at the output",
    0x2340: "short circuit at the motor",
    0x3110: "mains overvoltage",
    0x3120: "mains undervoltage",
    0x3210: "overvoltage of the DC link",
    0x3220: "undervoltage of the DC link",
    0x4110: "ambient temperature too high",
    0x4210: "temperature of the drive too high",
    0x4310: "temperature of the motor too high",
    0x5112: "supply of the electronics too low",
    0x5441: "contact of the stop input",
    0x5530: "parameter memory failed",
    0x6010: "software reset by its watchdog",
    0x6320: "parameter error",
    0x7121: "motor blocked",
    0x7300: "sensor failed",
    0x7303: "resolver 1 failed",
    0x7304: "resolver 2 failed",
    0x7305: "incremental encoder 1 failed",
    0x7306: "incremental encoder 2 failed",
    0x7320: "position sensor failed",
    0x8110: "CAN overrun, messages were lost",
    0x8120: "CAN in error passive mode",
    HEARTBEAT_LOST: "heartbeat or life guard lost",
    0x8140: "recovered from bus off",
    0x8210: "PDO too short, not processed",
    0x8220: "PDO too long",
    0x8240: "unexpected length of SYNC",
    RPDO_TIMEOUT: "target values did not come in time",
    0x8311: "excess torque",
    0x8611: "following error",
    0xFF00: "device specific",
}


def in_words(code: int) -> str:
    """What an error code means: as CiA 301 and CiA 402 list it, else the class that it is in."""
    meaning = WORDS.get(code) or EmcyError(code, 0, b"", 0.0).get_desc().lower()
    return f"0x{code:04X}, {meaning or 'unknown to CiA 301 and CiA 402'}"
