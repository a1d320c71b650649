"""Reading the MCAP file of a recording: a whole one strictly, a cut one as far as it goes."""

from __future__ import annotations

import json
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import pydantic

from alight.files import FileError, file_to_read
from alight.simulation.mcap_messages import Samples
from alight.simulation.mcap_writer import EVENTS, TOPIC
from alight.simulation.recording_description import KEY, Description
from alight.simulation.recording_events import Event

MAGIC = bytes((137, 77, 67, 65, 80, 48, 13, 10))
HEAD = struct.Struct("<BQ")
"""What every record begins with: its kind, and the length of what follows."""
MESSAGE_HEAD = [
    ("opcode", "u1"),
    ("length", "<u8"),
    ("channel", "<u2"),
    ("sequence", "<u4"),
    ("log_time", "<u8"),
    ("publish_time", "<u8"),
]
_EVENTS = pydantic.TypeAdapter(Event)


@dataclass(frozen=True)
class Content:
    """What stands in a file."""

    description: Description
    numbers: np.ndarray
    """One row for each sample, time first."""
    row: np.ndarray
    """Number of each sample, counted from the start of the run."""
    events: tuple[Event, ...]
    problem: str
    """Where and why the file ends early; empty if it has an end."""

    @property
    def cut(self) -> bool:
        """Whether samples are missing at its end."""
        promised = self.description.samples
        return promised is None or (bool(self.problem) and promised != len(self.numbers))


def read_content(path: Path) -> Content:
    """Read the file of a recording.

    A file with an end is whole, or damaged and refused. One without was cut off, by a kill or by
    the end of the power: it is read up to its first record that is not whole.

    Raises
    ------
    FileError
        If the file cannot be read, is damaged, holds no recording of Alight, or was cut before
        it said of what it is a recording.
    """
    with file_to_read(path, "an MCAP file") as file:
        size = file.seek(0, 2)
        file.seek(max(size - len(MAGIC), 0))
        has_end = file.read() == MAGIC and size > 2 * len(MAGIC)
        file.seek(0)
        if file.read(len(MAGIC)) != MAGIC:
            raise ValueError("its first bytes are others")
        reader = _Reader(path)
        problem = "" if has_end else f"the file ends at byte {size} in the midst of the recording"
        try:
            for opcode, content in _records(file, size):
                reader.take(opcode, content)
        except Exception as error:
            if has_end or isinstance(error, FileError):
                raise
            problem = f"from byte {file.tell()} on the file is not whole: {error}"
    if not has_end and reader.ended:
        problem = ""
    if reader.description is None:
        if has_end or reader.ended:
            raise FileError(path, f"is no recording: it has no metadata record {KEY!r}")
        reason = "it ends before it says of what it is a recording"
        raise FileError(path, f"is damaged, or is not an MCAP file: {reason}")
    return reader.content(problem)


def _records(file: BinaryIO, size: int) -> Iterator[tuple[int, bytes]]:
    """The records of a file up to the end of its data, each whole, with the kind it is of."""
    from mcap.opcode import Opcode

    crc = zlib.crc32(MAGIC)
    while True:
        at = file.tell()
        head = file.read(HEAD.size)
        if len(head) < HEAD.size:
            raise ValueError(f"it ends at byte {size}")
        opcode, length = HEAD.unpack(head)
        if opcode == 0 or length > size - file.tell():
            file.seek(at)
            raise ValueError(f"the record there is not whole, the file ends at byte {size}")
        content = file.read(length)
        if opcode == Opcode.DATA_END:
            (stated,) = struct.unpack_from("<I", content)
            if stated not in (0, crc):
                raise ValueError("its bytes do not give the checksum that it states")
            yield opcode, content
            return
        crc = zlib.crc32(content, zlib.crc32(head, crc))
        yield opcode, content


@dataclass
class _Reader:
    """Takes records one by one."""

    path: Path
    description: Description | None = None
    ended: bool = False
    samples: Samples | None = None
    record: np.dtype | None = None
    channels: dict[int, str] = field(default_factory=dict)
    numbers: list[np.ndarray] = field(default_factory=list)
    row: list[np.ndarray] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)

    def take(self, opcode: int, content: bytes) -> None:
        """Take a record that stands in the file itself."""
        from mcap.opcode import Opcode
        from mcap.records import Chunk, Metadata
        from mcap.stream_reader import get_chunk_data_stream

        if opcode == Opcode.METADATA:
            found = Metadata.read(_stream(content))
            if found.name == KEY:
                self._describe(found.metadata["json"])
        elif opcode == Opcode.CHUNK:
            data, length = get_chunk_data_stream(Chunk.read(_stream(content)), validate_crc=True)
            self._take_all(data.read(length))
        elif opcode == Opcode.DATA_END:
            self.ended = True
        else:
            self._take_all(HEAD.pack(opcode, len(content)) + content)

    def _describe(self, text: str) -> None:
        self.description = Description.read(text, self.path)
        if self.samples is None:
            self.samples = Samples(self.description.names)
            self.record = np.dtype([*MESSAGE_HEAD, ("data", self.samples.dtype)])

    def _take_all(self, data: bytes) -> None:
        """Take the records of a chunk; those of samples in one go."""
        from mcap.opcode import Opcode
        from mcap.records import Channel

        at = 0
        while at < len(data):
            opcode, length = HEAD.unpack_from(data, at)
            if opcode == Opcode.MESSAGE:
                (channel,) = struct.unpack_from("<H", data, at + HEAD.size)
                topic = self.channels[channel]
                if topic == TOPIC:
                    at += self._take_samples(data, at)
                    continue
                if topic == EVENTS:
                    head = np.dtype(MESSAGE_HEAD).itemsize
                    self._take_event(data[at + head : at + HEAD.size + length])
            elif opcode == Opcode.CHANNEL:
                found = Channel.read(_stream(data[at + HEAD.size :]))
                self.channels[found.id] = found.topic
            at += HEAD.size + length

    def _take_samples(self, data: bytes, at: int) -> int:
        """Take the samples that follow one another from a place on; how many bytes they are."""
        if self.samples is None or self.record is None:
            raise ValueError("it has samples before their description")
        size = self.record.itemsize
        found = np.frombuffer(data, self.record, (len(data) - at) // size, at)
        same = np.ones(len(found), dtype=bool)
        for name in ("opcode", "length", "channel"):
            same &= found[name] == found[name][:1]
        found = found if same.all() else found[: int(np.argmin(same))]
        if not len(found) or found["length"][0] != size - HEAD.size:
            raise ValueError("a sample has other columns than its description promises")
        if not self.samples.are_ours(found["data"]).all():
            raise ValueError("a sample is encoded in another way")
        numbers = np.empty((len(found), len(self.samples.fields)))
        self.samples.decode(found["data"], numbers)
        self.numbers.append(numbers)
        self.row.append(found["sequence"].astype(np.int64))
        return len(found) * size

    def _take_event(self, data: bytes) -> None:
        self.events.append(_EVENTS.validate_python(json.loads(data)))

    def content(self, problem: str) -> Content:
        """Everything that was taken."""
        if self.description is None or self.samples is None:
            raise FileError(self.path, "is no recording")
        width = len(self.samples.fields)
        numbers = joined(self.numbers, width)
        row = np.concatenate([np.empty(0, np.int64), *self.row])
        return Content(self.description, numbers, row, tuple(self.events), problem)


def joined(parts: list[np.ndarray], width: int) -> np.ndarray:
    """One array of all parts, which are given up one by one: memory holds them hardly twice."""
    made, at = np.empty((sum(len(part) for part in parts), width)), 0
    for part in parts:
        made[at : at + len(part)] = part
        at += len(part)
    parts.clear()
    return made


def _stream(content: bytes) -> Any:
    from mcap.data_stream import ReadDataStream

    return ReadDataStream(BytesIO(content))
