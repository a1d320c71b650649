"""Samples as protobuf messages, whole blocks of them at once.

Every field of a message is set, and is a double: in the bytes each message looks like the next,
tags and all, so that a block of rows becomes a block of messages by copying columns.
"""

from __future__ import annotations

import itertools
import re
from functools import cached_property
from typing import Any

import numpy as np

PACKAGE, MESSAGE = "alight", "Sample"
NAME = f"{PACKAGE}.{MESSAGE}"
FIXED64 = 1
"""Wire type of a double: the lowest three bits of a tag."""


class Samples:
    """Messages with one double for each column, in both directions.

    Parameters
    ----------
    columns : list of str
        Names of the columns; the fields' names are made of them.
    """

    def __init__(self, columns: list[str]) -> None:
        self.fields = field_names(columns)
        self._tags = [_varint(n << 3 | FIXED64) for n in range(1, len(columns) + 1)]

    @cached_property
    def _runs(self) -> list[tuple[int, int, int]]:
        """Fields that follow one another and whose tags are equally long: first, last, length."""
        lengths = np.array([len(tag) for tag in self._tags])
        edges = [0, *(np.flatnonzero(np.diff(lengths)) + 1), len(lengths)]
        return [(a, b, int(lengths[a])) for a, b in itertools.pairwise(edges) if b > a]

    @cached_property
    def dtype(self) -> np.dtype:
        """Layout of a message in bytes."""
        return np.dtype(
            [
                (f"run{i}", [("tag", "u1", (length,)), ("value", "<f8")], (last - first,))
                for i, (first, last, length) in enumerate(self._runs)
            ]
        )

    def encode(self, rows: np.ndarray) -> np.ndarray:
        """The messages of rows, shape (n, columns), as an array of ``dtype``."""
        made = np.empty(len(rows), self.dtype)
        for i, (first, last, _) in enumerate(self._runs):
            made[f"run{i}"]["tag"] = self._tags_of(first, last)
            made[f"run{i}"]["value"] = rows[:, first:last]
        return made

    def decode(self, messages: np.ndarray, rows: np.ndarray) -> None:
        """Fill in the rows of messages that `are_ours`."""
        for i, (first, last, _) in enumerate(self._runs):
            rows[:, first:last] = messages[f"run{i}"]["value"]

    def are_ours(self, messages: np.ndarray) -> np.ndarray:
        """For each message whether its tags are those that `encode` writes."""
        found = np.ones(len(messages), dtype=bool)
        for i, (first, last, _) in enumerate(self._runs):
            found &= (messages[f"run{i}"]["tag"] == self._tags_of(first, last)).all(axis=(1, 2))
        return found

    def _tags_of(self, first: int, last: int) -> np.ndarray:
        return np.array([list(tag) for tag in self._tags[first:last]], dtype=np.uint8)

    def message_class(self) -> Any:
        """The message as a class of ``google.protobuf``."""
        from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

        # proto2, because it writes a zero like any other number; proto3 would leave it out.
        file = descriptor_pb2.FileDescriptorProto(
            name="alight/sample.proto", package=PACKAGE, syntax="proto2"
        )
        message = file.message_type.add(name=MESSAGE)
        kinds = descriptor_pb2.FieldDescriptorProto
        for number, name in enumerate(self.fields, start=1):
            message.field.add(
                name=name,
                json_name=name,  # the one that is made of it may be the same for two names
                number=number,
                type=kinds.TYPE_DOUBLE,
                label=kinds.LABEL_OPTIONAL,
            )
        pool = descriptor_pool.DescriptorPool()
        pool.Add(file)
        return message_factory.GetMessageClass(pool.FindMessageTypeByName(NAME))


def field_names(columns: list[str]) -> list[str]:
    """Names that protobuf accepts: letters, digits and underscores, each name once."""
    found: list[str] = []
    for column in columns:
        name = re.sub(r"\W", "_", column, flags=re.ASCII)
        name = name if re.match(r"[A-Za-z_]", name) else f"_{name}"
        while name in found:
            name += "_"
        found.append(name)
    return found


def _varint(number: int) -> bytes:
    """A number as protobuf packs it: seven bits a byte, the lowest first."""
    found = bytearray()
    while number > 0x7F:
        found.append(number & 0x7F | 0x80)
        number >>= 7
    return bytes([*found, number])
