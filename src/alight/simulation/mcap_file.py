"""Recordings as MCAP: one protobuf message for each sample, for Foxglove and its like."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from alight.files import whole_file
from alight.simulation.mcap_messages import field_names
from alight.simulation.mcap_parts import read_parts
from alight.simulation.mcap_writer import EVENTS, TOPIC, RecordingWriter, nanoseconds
from alight.simulation.recording import Recording
from alight.simulation.recording_description import description_of, names_and_numbers
from alight.simulation.verdict import Outcome, Verdict

__all__ = ["EVENTS", "TOPIC", "field_names", "load_mcap", "save_mcap"]

BLOCK = 4096
"""Samples that are turned into messages at once."""


def save_mcap(recording: Recording, path: str | Path) -> None:
    """Save a recording as an MCAP file that Foxglove and the ``mcap`` libraries read.

    Each sample is one message on the topic ``/recording`` with the exact time ``t`` and one
    double for every scalar signal; its log time is ``t`` in nanoseconds. Events are JSON messages
    on the topic ``/events``. Verdict, layout with units, and scenario stand as JSON in the
    metadata record ``alight``. Numbers are kept to the bit.

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
    names, numbers = names_and_numbers(recording)
    nanoseconds(numbers[:, 0])
    description = description_of(recording, events=False)
    with whole_file(path) as file:
        writer = RecordingWriter(file, names)
        writer.describe(description)
        for event in recording.events:  # before the last sample, whose presence shows a whole file
            writer.event(event)
        for first in range(0, len(numbers), BLOCK):
            writer.samples(numbers[first : first + BLOCK], first)
        writer.finish()


def load_mcap(path: str | Path) -> Recording:
    """Load a recording that `save_mcap` or the live bench saved.

    One that was cut off is loaded up to there, with a verdict that says so; one whose recorder
    was killed is joined with the files beside it in which it goes on.

    Parameters
    ----------
    path : str or Path
        The file.

    Raises
    ------
    FileError
        If the file cannot be read, is damaged, or holds no recording of Alight.
    """
    path = Path(path)
    content = read_parts(path)
    description = dataclasses.replace(content.description, events=content.events)
    if not content.cut:
        return description.recording(content.numbers, path)
    recording = description.of(content.numbers)
    end = float(recording.t[-1]) if len(recording) else 0.0
    verdict = Verdict(Outcome.CUT_OFF, end, None, content.problem or "its end was never written")
    return dataclasses.replace(recording, verdict=verdict)
