"""Recordings that go on in another file, because their recorder was killed in the midst."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import numpy as np

from alight.files import FileError
from alight.simulation.mcap_reader import Content, read_content

CONTINUES = "continues"
"""Key of the table ``bench`` that says which file goes on here: its name, and from which row."""
HEADING = 65536
"""No file says later than at this byte of what it is a recording."""


def next_part(path: Path) -> Path:
    """Name of the file in which a recording goes on."""
    stem, number = path.stem, 1
    if found := re.fullmatch(r"(.*)\.part(\d+)", stem):
        stem, number = found[1], int(found[2])
    return path.with_name(f"{stem}.part{number + 1}{path.suffix}")


def read_parts(path: Path) -> Content:
    """Read a file, and those beside it in which its recording goes on.

    Raises
    ------
    FileError
        If one of them cannot be read, or is damaged.
    """
    content = read_content(path)
    names, part = {path.name}, path
    while content.cut and (part := next_part(part)).exists():
        following = _read_part(part)
        # A recorder may have been killed before it could tell the one after it of its own file:
        # then both go on where an earlier file ended.
        if following is not None:
            if following.description.bench.get(CONTINUES, {}).get("file") not in names:
                break
            content = _joined(content, following, part)
            names.add(part.name)
    return content


def _read_part(path: Path) -> Content | None:
    """Read a file; None if it was cut before it could say of what it is a recording."""
    try:
        return read_content(path)
    except FileError:
        if path.stat().st_size < HEADING:
            return None
        raise


def _joined(content: Content, part: Content, path: Path) -> Content:
    if part.description.names != content.description.names:
        raise FileError(path, "goes on with other columns")
    begins = int(part.description.bench[CONTINUES]["row"])
    kept = content.row < begins
    description = dataclasses.replace(part.description, bench=content.description.bench)
    before = tuple(event for event in content.events if event.row < begins)
    told = {event.number for event in before if event.number}
    samples = part.description.samples
    if samples is not None:
        description = dataclasses.replace(description, samples=samples + int(kept.sum()))
    return Content(
        description,
        np.concatenate([content.numbers[kept], part.numbers]),
        np.concatenate([content.row[kept], part.row]),
        (*before, *(event for event in part.events if event.number not in told)),
        part.problem,
    )
