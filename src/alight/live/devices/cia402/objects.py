"""The objects of CiA 301, 402 and 406 that the bench uses, as object dictionaries."""

from __future__ import annotations

from enum import IntEnum

from canopen import ObjectDictionary
from canopen.objectdictionary import ODRecord, ODVariable, datatypes

DEVICE_TYPE = 0x1000
CYCLE_PERIOD = 0x1006
CONSUMER_HEARTBEAT = 0x1016
PRODUCER_HEARTBEAT = 0x1017
ABORT_CONNECTION = 0x6007
ERROR_CODE = 0x603F
CONTROLWORD = 0x6040
STATUSWORD = 0x6041
QUICK_STOP_OPTION = 0x605A
FAULT_OPTION = 0x605E
MODE = 0x6060
MODE_SHOWN = 0x6061
POSITION = 0x6064
TARGET_TORQUE = 0x6071
MOST_TORQUE = 0x6072
RATED_TORQUE = 0x6076
TORQUE = 0x6077
TORQUE_SLOPE = 0x6087
ENCODER_RESOLUTION = 0x608F
INTERPOLATION_PERIOD = 0x60C2
SUPPORTED_MODES = 0x6502

DRIVES_PROFILE, ENCODERS_PROFILE = 402, 406

SYNC, HEARTBEAT = 0x080, 0x700
"""Identifier of SYNC; what is added to the number of a node for its heartbeat."""


class Mode(IntEnum):
    """Modes of operation that take a torque."""

    PROFILE_TORQUE = 4
    CYCLIC_SYNCHRONOUS_TORQUE = 10


def integer_type(bits: int, signed: bool) -> int:
    """CANopen's number of a type."""
    kind = "INTEGER" if signed else "UNSIGNED"
    return int(getattr(datatypes, f"{kind}{bits}"))


class Dictionary(ObjectDictionary):
    """An object dictionary that is made in code."""

    def number(
        self, index: int, name: str, bits: int, value: int = 0, *, signed: bool = False
    ) -> None:
        """Add an object that is one whole number."""
        self.add_object(_variable(name, index, 0, bits, value, signed))

    def record(self, index: int, name: str, *entries: tuple[int, int, int]) -> None:
        """Add an object of several numbers: subindex, bits, value."""
        record = ODRecord(name, index)
        for subindex, bits, value in entries:
            record.add_member(_variable(f"{name} {subindex}", index, subindex, bits, value))
        self.add_object(record)

    def auxiliary(self, index: int, subindex: int, bits: int, *, signed: bool) -> None:
        """Add an object that a configuration names, unless it is there."""
        name = f"object {index:04X}"
        if subindex == 0:
            if index not in self:
                self.number(index, name, bits, signed=signed)
            return
        if index not in self:
            self.record(index, name, (0, 8, subindex))
        found = self[index]
        if isinstance(found, ODRecord) and subindex not in found:
            found.add_member(_variable(f"{name} {subindex}", index, subindex, bits, 0, signed))

    def pdo(self, number: int, transmit: bool) -> None:
        """Add a PDO: its communication parameters and its mapping."""
        base, kind = (0x1800, "transmit") if transmit else (0x1400, "receive")
        index = base + number - 1
        not_valid = 0x80000000
        self.record(
            index, f"{kind} PDO {number}", (0, 8, 5), (1, 32, not_valid), (2, 8, 255), (3, 16, 0),
            (5, 16, 0),
        )  # fmt: skip
        entries = ((subindex, 32, 0) for subindex in range(1, 9))
        self.record(index + 0x200, f"{kind} mapping {number}", (0, 8, 0), *entries)


def _variable(
    name: str, index: int, subindex: int, bits: int, value: int, signed: bool = False
) -> ODVariable:
    made = ODVariable(name, index, subindex)
    made.data_type = integer_type(bits, signed)
    made.access_type = "rw"
    made.pdo_mappable = True
    made.default = value
    return made


def communication(profile: int) -> Dictionary:
    """The objects of CiA 301 that every node of the bench has."""
    made = Dictionary()  # type: ignore[no-untyped-call]
    made.number(DEVICE_TYPE, "device type", 32, profile)
    made.number(0x1001, "error register", 8)
    made.number(CYCLE_PERIOD, "communication cycle period", 32)
    made.record(CONSUMER_HEARTBEAT, "consumer heartbeat time", (0, 8, 1), (1, 32, 0))
    made.number(PRODUCER_HEARTBEAT, "producer heartbeat time", 16)
    made.pdo(1, transmit=True)
    return made


def drive_objects() -> Dictionary:
    """The objects of a drive that the bench uses."""
    made = communication(DRIVES_PROFILE)
    made.pdo(2, transmit=True)
    made.pdo(1, transmit=False)
    made.number(ABORT_CONNECTION, "abort connection option code", 16, 1, signed=True)
    made.number(ERROR_CODE, "error code", 16)
    made.number(CONTROLWORD, "controlword", 16)
    made.number(STATUSWORD, "statusword", 16)
    made.number(QUICK_STOP_OPTION, "quick stop option code", 16, 2, signed=True)
    made.number(FAULT_OPTION, "fault reaction option code", 16, 2, signed=True)
    made.number(MODE, "modes of operation", 8, signed=True)
    made.number(MODE_SHOWN, "modes of operation display", 8, signed=True)
    made.number(POSITION, "position actual value", 32, signed=True)
    made.number(TARGET_TORQUE, "target torque", 16, signed=True)
    made.number(MOST_TORQUE, "max torque", 16, 1000)
    made.number(RATED_TORQUE, "motor rated torque", 32, 1000)
    made.number(TORQUE, "torque actual value", 16, signed=True)
    made.number(TORQUE_SLOPE, "torque slope", 32)
    made.record(ENCODER_RESOLUTION, "encoder resolution", (0, 8, 2), (1, 32, 4096), (2, 32, 1))
    made.record(INTERPOLATION_PERIOD, "interpolation period", (0, 8, 2), (1, 8, 1), (2, 8, 0xFD))
    made.number(SUPPORTED_MODES, "supported drive modes", 32)
    return made
