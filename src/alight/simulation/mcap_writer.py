"""Writing the MCAP file of a recording, at once or while it runs."""

from __future__ import annotations

import json
from typing import Any, BinaryIO

import numpy as np

from alight.errors import AlightError
from alight.simulation.mcap_messages import Samples
from alight.simulation.recording_description import KEY
from alight.simulation.recording_events import SCHEMA, Event

TOPIC, EVENTS = "/recording", "/events"
LATEST = 2**63 * 1e-9
"""A time [s] whose nanoseconds every reader can still hold."""
SEQUENCES = 2**32
"""Sequence numbers of MCAP begin anew here."""


class RecordingWriter:
    """Puts a recording into an MCAP file: descriptions, samples, events.

    Parameters
    ----------
    file : BinaryIO
        Where to; it stays open.
    columns : list of str
        Name of each column, time first.
    """

    def __init__(self, file: BinaryIO, columns: list[str]) -> None:
        from mcap.well_known import MessageEncoding, SchemaEncoding
        from mcap.writer import Writer
        from mcap_protobuf.schema import register_schema

        self._samples = Samples(columns)
        self._width = self._samples.dtype.itemsize
        self._writer: Any = Writer(file, enable_data_crcs=True)
        self._writer.start(library="alight")
        schema = register_schema(self._writer, self._samples.message_class())
        self._topic = self._writer.register_channel(TOPIC, MessageEncoding.Protobuf, schema)
        schema = self._writer.register_schema(
            "alight.Event", SchemaEncoding.JSONSchema, json.dumps(SCHEMA).encode()
        )
        self._events = self._writer.register_channel(EVENTS, MessageEncoding.JSON, schema)

    def describe(self, description: str) -> None:
        """Put in what is known of the recording; the last description counts."""
        self._writer.add_metadata(KEY, {"json": description})

    def samples(self, rows: np.ndarray, first: int = 0) -> None:
        """Put in samples, shape (n, columns), of which the first has the number ``first``.

        Raises
        ------
        AlightError
            If a time is negative or not finite.
        """
        times = nanoseconds(rows[:, 0])
        messages, width = memoryview(self._samples.encode(rows).tobytes()), self._width
        for i, time in enumerate(times):
            self._writer.add_message(
                self._topic,
                log_time=time,
                data=messages[i * width : (i + 1) * width],
                publish_time=time,
                sequence=(first + i) % SEQUENCES,
            )

    def event(self, event: Event) -> None:
        """Put in an event."""
        (time,) = nanoseconds(np.array([event.t]))
        self._writer.add_message(
            self._events,
            log_time=time,
            data=event.as_json().encode(),
            publish_time=time,
            sequence=event.row % SEQUENCES,
        )

    def flush(self) -> None:
        """Hand everything over to the file; a reader finds it whole."""
        self._writer.flush()

    def finish(self) -> None:
        """Write index and end."""
        self._writer.finish()


def nanoseconds(t: np.ndarray) -> list[int]:
    """Times in whole nanoseconds.

    Raises
    ------
    AlightError
        If one is negative, not finite, or later than a reader can hold.
    """
    if not np.all((t >= 0) & (t < LATEST)):
        raise AlightError(
            f"an MCAP file has no times before 0 or after {LATEST:.3g} s; "
            "shift t, or save the recording as Parquet"
        )
    return [int(ns) for ns in np.rint(t * 1e9)]
