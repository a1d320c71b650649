"""What the steering page asks of the host: whole sets of numbers, taken between two ticks."""

from __future__ import annotations

import threading
import zlib
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path

import numpy as np

from alight.errors import AlightError
from alight.live.shared.block import create_block, open_block

SLOTS = 1024
MOST_VALUES = 256
MOST_TEXT = 8192
REASON = 240

SLOT = np.dtype(
    [
        ("number", "u8"),
        ("tick", "f8"),
        ("kind", "u4"),
        ("law", "u4"),
        ("count", "u4"),
        ("length", "u4"),
        ("crc", "u4"),
        ("outcome", "u4"),
        ("values", "f8", (MOST_VALUES,)),
        ("text", f"V{MOST_TEXT}"),
        ("reason", f"S{REASON}"),
    ]
)
"""The first slot of the file is the header: ``number`` the last submitted, ``tick`` the last done
(as a whole number, so that both are single words)."""


class Kind(IntEnum):
    """What a command asks for."""

    START = 1
    STOP = 2
    RESET = 3
    KICK = 4
    """``values``: torque at either joint [N m], duration [s]."""
    PARAMETERS = 5
    """``values``: every parameter of law ``law``, in the order of its `Controller`."""
    LAW = 6
    """Change over to law ``law`` with the parameters in ``values``."""


class Outcome(IntEnum):
    """What became of a command."""

    PENDING = 0
    APPLIED = 1
    REFUSED = 2


@dataclass(frozen=True)
class Command:
    """A command as the host takes it, whole and checked against its checksum."""

    number: int
    kind: Kind
    law: int
    values: np.ndarray


@dataclass(frozen=True)
class Answer:
    """What became of a command: at which row of telemetry, and why if it was refused."""

    outcome: Outcome
    tick: int
    """Number of the row of telemetry that is the first to show its effect."""
    reason: str


class CommandBox:
    """Slots in shared memory: one process submits, the host takes, anybody reads what was done.

    A command becomes visible when its slot is whole; one whose submitter died in the midst of
    writing was never there.
    """

    def __init__(self, block: np.ndarray) -> None:
        self._slots = block[1:]
        self._submitted = block["number"][:1]
        self._done = block["tick"][:1]
        self._barrier = threading.Lock()

    @classmethod
    def create(cls, path: Path) -> CommandBox:
        """Make an empty box."""
        return cls(create_block(path, SLOT, SLOTS + 1))

    @classmethod
    def open(cls, path: Path) -> CommandBox:
        """Attach to a box that another process made."""
        return cls(open_block(path, SLOT))

    @property
    def submitted(self) -> int:
        """Number of the last command submitted; the first has number 1."""
        return int(self._submitted[0])

    @property
    def done(self) -> int:
        """Number of the last command that the host has dealt with."""
        return int(self._done[0])

    def submit(self, kind: Kind, *, law: int = 0, values: object = (), text: str = "") -> int:
        """Hand over a command; the submitter's side.

        Parameters
        ----------
        kind : Kind
            What is asked for.
        law : int
            Number of the law it is about.
        values : (n,) array
            Finite numbers.
        text : str
            What it means to a person, or as JSON to the recorder; the host does not read it.

        Returns
        -------
        int
            Number of the command, to ask `answer` about.

        Raises
        ------
        AlightError
            If a number is not finite, there are too many, or the host has long not answered.
        """
        numbers, meaning = np.asarray(values, dtype=float).ravel(), text.encode()
        if len(numbers) > MOST_VALUES or not np.isfinite(numbers).all():
            raise AlightError(f"a command takes at most {MOST_VALUES} numbers, all of them finite")
        if len(meaning) > MOST_TEXT:
            raise AlightError(f"a command takes a text of at most {MOST_TEXT} bytes")
        if self.submitted - self.done >= SLOTS // 2:
            raise AlightError("the host has not answered for long; see whether it is alive")
        number = self.submitted + 1
        slot = self._slots[number % SLOTS]
        slot["number"], slot["tick"], slot["outcome"], slot["reason"] = number, 0.0, 0, b""
        slot["kind"], slot["law"] = kind, law
        slot["count"], slot["length"] = len(numbers), len(meaning)
        slot["values"][: len(numbers)] = numbers
        slot["text"] = meaning.ljust(MOST_TEXT, b"\0")
        slot["crc"] = _checksum(slot)
        with self._barrier:
            pass
        self._submitted[0] = number
        return number

    def take(self) -> Command | None:
        """The next command that waits, None if there is none; the host's side.

        It is to be answered before the next is taken. One that is not whole is refused here.
        """
        if self._submitted[0] == self._done[0]:
            return None
        number = self.done + 1
        slot = self._slots[number % SLOTS]
        whole = slot["number"] == number and slot["count"] <= MOST_VALUES
        if not whole or slot["crc"] != _checksum(slot) or slot["kind"] not in list(Kind):
            self.reply(number, Outcome.REFUSED, 0, "it is damaged")
            return None
        values = slot["values"][: slot["count"]].copy()
        return Command(number, Kind(slot["kind"]), int(slot["law"]), values)

    def reply(self, number: int, outcome: Outcome, tick: int, reason: str = "") -> None:
        """Say what became of a command; the host's side."""
        slot = self._slots[number % SLOTS]
        slot["tick"], slot["reason"] = tick, reason.encode()[:REASON]
        slot["outcome"] = outcome
        with self._barrier:
            pass
        self._done[0] = number

    def answer(self, number: int) -> Answer:
        """What became of a command."""
        slot = self._slots[number % SLOTS]
        if number > self.done or slot["number"] != number:
            return Answer(Outcome.PENDING, 0, "")
        reason = slot["reason"].decode(errors="replace")
        return Answer(Outcome(int(slot["outcome"])), int(slot["tick"]), reason)

    def command(self, number: int) -> Command | None:
        """A command as it was submitted; None if it is no longer kept."""
        slot = self._slots[number % SLOTS].copy()
        if (
            slot["number"] != number
            or slot["count"] > MOST_VALUES
            or slot["kind"] not in list(Kind)
        ):
            return None
        values = slot["values"][: slot["count"]]
        return Command(number, Kind(slot["kind"]), int(slot["law"]), values)

    def kind_of(self, number: int) -> Kind | None:
        """What a command asked for; None if it is no longer kept."""
        slot = self._slots[number % SLOTS]
        return Kind(int(slot["kind"])) if slot["number"] == number else None

    def text_of(self, number: int) -> str:
        """The text that a command was submitted with; empty if it is no longer kept."""
        slot = self._slots[number % SLOTS]
        if slot["number"] != number:
            return ""
        return bytes(slot["text"])[: int(slot["length"])].decode(errors="replace")


def _checksum(slot: np.void) -> int:
    head = (int(slot[name]) for name in ("number", "kind", "law", "count"))
    return zlib.crc32(repr(tuple(head)).encode() + slot["values"][: slot["count"]].tobytes())
