"""Configuration of real drives: a TOML file, and what is refused in it."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import field
from pathlib import Path
from typing import Annotated, Any, Literal

import annotated_types as at
import pydantic

from alight.errors import AlightError
from alight.symbolic.parameters import Positive, Quantity, parameters, problems_of

Node = Annotated[int, at.Ge(1), at.Le(127)]
Index = Annotated[int, at.Ge(0x1000), at.Le(0xFFFF)]
Subindex = Annotated[int, at.Ge(0), at.Le(254)]
Seconds = Annotated[float, at.Gt(0), at.Le(60)]
NonZero = Annotated[float, pydantic.AfterValidator(lambda value: _not_zero(value))]


class DrivesError(AlightError):
    """Drives that cannot be used as configured: file, field, value, and what would be right."""

    def __init__(self, file: str | Path, problems: Sequence[str]) -> None:
        self.file = str(file)
        self.problems = list(problems)
        super().__init__("\n".join([self.file + ":", *(f"  {line}" for line in self.problems)]))


def _not_zero(value: float) -> float:
    if value == 0:
        raise ValueError("Input should not be zero")
    return value


@parameters
class BusSettings:
    """A CAN bus, as python-can opens it."""

    interface: Annotated[str, Quantity("", "python-can's name of the interface: socketcan, pcan")]
    channel: Annotated[str | int, Quantity("", "which one of that kind: can0")]
    bitrate: Annotated[int, at.Ge(10_000), at.Le(1_000_000), Quantity("bit/s", "classic CAN")] = (
        1_000_000
    )
    options: Annotated[
        dict[str, Any], Quantity("", "what else that interface of python-can is told")
    ] = field(default_factory=dict)


@parameters
class ObjectValue:
    """An object that is written when the drives are opened."""

    index: Index
    value: Annotated[int, Quantity("", "what is written")]
    bits: Annotated[Literal[8, 16, 32], Quantity("", "size of the object")]
    subindex: Subindex = 0


@parameters
class AxisSettings:
    """The drive of a joint."""

    node: Annotated[Node, Quantity("", "number of the node")]
    bus: Annotated[str, Quantity("", "name of its bus: a table [bus.NAME]")]
    mode: Annotated[
        Literal["cyclic-synchronous-torque", "profile-torque"],
        Quantity("", "mode of operation: 10 or 4"),
    ] = "cyclic-synchronous-torque"
    rated_torque: Annotated[
        Positive | None, Quantity("N m", "rated torque of the motor; object 0x6076 if absent")
    ] = None
    gear: Annotated[Positive, Quantity("", "turns of the motor for one of the joint")] = 1.0
    increments: Annotated[
        Positive | None,
        Quantity("1/rev", "increments in a turn of the motor; object 0x608F if absent"),
    ] = None
    zero: Annotated[float, Quantity("rad", "joint angle at which the encoder shows zero")] = 0.0
    direction: Annotated[Literal[1, -1], Quantity("", "-1: motor counts against the joint")] = 1
    objects: Annotated[
        tuple[ObjectValue, ...], Quantity("", "objects to write at opening, before all others")
    ] = ()


@parameters
class NodeTransducer:
    """Transducer of the mass with a node of its own, as CiA 406 has it."""

    type: Annotated[Literal["transducer"], Quantity("", "a node of its own")]
    node: Annotated[Node, Quantity("", "number of the node")]
    bus: Annotated[str, Quantity("", "name of its bus")]
    scale: Annotated[NonZero, Quantity("m", "what one step is; negative against the axis")]
    offset: Annotated[float, Quantity("m", "position at which it shows zero")] = 0.0
    index: Index = 0x6004
    subindex: Subindex = 0
    bits: Annotated[Literal[8, 16, 32], Quantity("", "size of the object")] = 32
    signed: bool = False


@parameters
class DriveTransducer:
    """Transducer of the mass at an auxiliary input of a drive."""

    type: Annotated[Literal["drive"], Quantity("", "an object of a drive")]
    axis: Annotated[Literal[1, 2], Quantity("", "which drive")]
    index: Annotated[Index, Quantity("", "object that holds the position")]
    scale: Annotated[NonZero, Quantity("m", "what one step is; negative against the axis")]
    offset: Annotated[float, Quantity("m", "position at which it shows zero")] = 0.0
    subindex: Subindex = 0
    bits: Annotated[Literal[8, 16, 32], Quantity("", "size of the object")] = 32
    signed: bool = True


AnyTransducer = Annotated[NodeTransducer | DriveTransducer, pydantic.Field(discriminator="type")]


@parameters
class Timing:
    """How messages are exchanged, and how long is waited."""

    exchange: Annotated[
        Literal["pipelined", "fresh"],
        Quantity("", "pipelined: a reading is one sample old; fresh: a tick waits for its reading"),
    ] = "pipelined"
    heartbeat: Annotated[Seconds, Quantity("s", "period of the host's heartbeat and of theirs")] = (
        0.02
    )
    watchdog: Annotated[
        Seconds, Quantity("s", "silence after which a drive, or the host, takes the other for dead")
    ] = 0.1
    answer: Annotated[Seconds, Quantity("s", "longest wait for an answer to an SDO")] = 0.5
    state: Annotated[Seconds, Quantity("s", "longest wait for a state of CiA 402")] = 2.0
    missing: Annotated[int, at.Ge(1), Quantity("", "ticks in a row without a measurement")] = 4
    fresh_wait: Annotated[
        Positive,
        Quantity(
            "",
            "ticks that `fresh` may wait for its reading; above 1 for simulated drives only, "
            "whose plant waits for the host",
        ),
    ] = 0.6

    def __post_init__(self) -> None:
        if self.watchdog < 2 * self.heartbeat:
            raise ValueError(
                f"watchdog = {self.watchdog} must be at least twice heartbeat = {self.heartbeat}: "
                "one late heartbeat is no death"
            )


@parameters
class DrivesSettings:
    """What stands in a drives file."""

    bus: dict[str, BusSettings]
    axis: Annotated[tuple[AxisSettings, AxisSettings], Quantity("", "shoulder, elbow")]
    position: AnyTransducer
    timing: Timing = Timing()
    node: Annotated[Node, Quantity("", "number of the host among the nodes")] = 127
    title: str = ""

    def __post_init__(self) -> None:
        problems = [*self._unknown_buses(), *self._taken_nodes()]
        if problems:
            raise ValueError("; ".join(problems))

    def _placed(self) -> list[tuple[str, str, int]]:
        """Path, bus and number of every node."""
        placed = [(f"axis.{i}", axis.bus, axis.node) for i, axis in enumerate(self.axis)]
        if isinstance(self.position, NodeTransducer):
            placed.append(("position", self.position.bus, self.position.node))
        return placed

    def _unknown_buses(self) -> list[str]:
        names = ", ".join(self.bus)
        return [
            f"{path}.bus = {bus!r}: there is no table [bus.{bus}]; one of: {names}"
            for path, bus, _ in self._placed()
            if bus not in self.bus
        ]

    def _taken_nodes(self) -> list[str]:
        taken = {(bus, self.node): "the host's node" for bus in self.bus}
        problems = []
        for path, bus, node in self._placed():
            if (bus, node) in taken:
                problems.append(f"{path}.node = {node}: is taken on that bus by {taken[bus, node]}")
            taken[bus, node] = path
        return problems


def load_drives(path: str | Path) -> DrivesSettings:
    """Read and validate a drives file.

    Raises
    ------
    DrivesError
        If it cannot be read, or anything in it is refused: names field, value, what would be right.
    """
    try:
        content = tomllib.loads(Path(path).read_text("utf-8-sig"))
    except OSError as error:
        raise DrivesError(path, [f"cannot be read: {error.strerror or error}"]) from None
    except UnicodeDecodeError:
        raise DrivesError(path, ["is not UTF-8; save the file in this encoding"]) from None
    except ValueError as error:
        raise DrivesError(path, [f"is not valid TOML: {error}"]) from None
    return drives_from(content, path)


def drives_from(content: Mapping[str, Any], path: str | Path) -> DrivesSettings:
    """Validate plain data; ``path`` stands in error messages."""
    try:
        return pydantic.TypeAdapter(DrivesSettings).validate_python(content)
    except pydantic.ValidationError as error:
        raise DrivesError(path, problems_of(error, content)) from None
