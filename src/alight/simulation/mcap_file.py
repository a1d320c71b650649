"""Recordings as MCAP: one protobuf message for each sample, for Foxglove and its like."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from alight.errors import AlightError
from alight.files import FileError, file_to_read, whole_file
from alight.simulation.recording import Recording
from alight.simulation.recording_description import (
    KEY,
    Description,
    description_of,
    names_and_numbers,
)

TOPIC = "/recording"
PACKAGE, MESSAGE = "alight", "Sample"
LATEST = 2**63 * 1e-9
"""A time [s] whose nanoseconds every reader can still hold."""


def save_mcap(recording: Recording, path: str | Path) -> None:
    """Save a recording as an MCAP file that Foxglove and the ``mcap`` libraries read.

    Each sample is one message on the topic ``/recording`` with the exact time ``t`` and one
    double for every scalar signal; its log time is ``t`` in nanoseconds. Verdict, layout with
    units, and scenario stand as JSON in the metadata record ``alight``. Numbers are kept to the
    bit.

    Parameters
    ----------
    recording : Recording
        What to save; its times must not be negative.
    path : str or Path
        Where; an older file there is replaced once the new one is complete.

    Raises
    ------
    FileError
        If the file cannot be written.
    AlightError
        If a time is negative or not finite, two columns bear the same name, or the scenario is
        not plain data.
    """
    from mcap_protobuf.writer import Writer

    names, numbers = names_and_numbers(recording)
    times = _nanoseconds(numbers[:, 0])
    description = description_of(recording)
    fields = field_names(names)
    sample = _message_class(fields)
    with whole_file(path) as file, Writer(file) as writer:
        writer.add_metadata(KEY, {"json": description})
        for i, (time, row) in enumerate(zip(times, numbers.tolist(), strict=True)):
            message = sample(**dict(zip(fields, row, strict=True)))
            writer.write_message(TOPIC, message, log_time=time, publish_time=time, sequence=i)


def load_mcap(path: str | Path) -> Recording:
    """Load a recording that `save_mcap` saved.

    Parameters
    ----------
    path : str or Path
        The file.

    Raises
    ------
    FileError
        If the file cannot be read, is damaged, or holds no recording of Alight.
    """
    from mcap.reader import make_reader
    from mcap_protobuf.decoder import DecoderFactory

    path = Path(path)
    with file_to_read(path, "an MCAP file") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        found = [m.metadata["json"] for m in reader.iter_metadata() if m.name == KEY]
        if not found:
            raise FileError(path, f"is no recording: it has no metadata record {KEY!r}")
        description = Description.read(found[0], path)
        # In the order of the file: log times are rounded and may coincide.
        messages = reader.iter_decoded_messages(TOPIC, log_time_order=False)
        rows = [[value for _, value in m.decoded_message.ListFields()] for m in messages]
        numbers = np.array(rows, dtype=float).reshape(len(rows), len(description.names))
        return description.recording(numbers, path)


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


def _nanoseconds(t: np.ndarray) -> list[int]:
    if not np.all((t >= 0) & (t < LATEST)):
        raise AlightError(
            f"an MCAP file has no times before 0 or after {LATEST:.3g} s; "
            "shift t, or save the recording as Parquet"
        )
    return [int(ns) for ns in np.rint(t * 1e9)]


def _message_class(fields: list[str]) -> Any:
    """A protobuf message with one double for each field."""
    from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

    # proto2, because it writes a zero like any other number; proto3 would leave it out.
    file = descriptor_pb2.FileDescriptorProto(
        name="alight/sample.proto", package=PACKAGE, syntax="proto2"
    )
    message = file.message_type.add(name=MESSAGE)
    kinds = descriptor_pb2.FieldDescriptorProto
    for number, name in enumerate(fields, start=1):
        message.field.add(
            name=name,
            json_name=name,  # the one that is made of it may be the same for two names
            number=number,
            type=kinds.TYPE_DOUBLE,
            label=kinds.LABEL_OPTIONAL,
        )
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName(f"{PACKAGE}.{MESSAGE}"))
