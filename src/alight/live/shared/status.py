"""What the host says of itself: whether it lives, how it is scheduled, how well it keeps time."""

from __future__ import annotations

from enum import IntEnum
from pathlib import Path
from typing import Any

import numpy as np

from alight.live.shared.block import create_block, open_block

EDGES = np.array([0, *np.geomspace(1e-6, 1.0, 61)])
"""Edges of the bins of both histograms [s]; what is longer counts in the last."""
TEXT = 480


class State(IntEnum):
    """What the host does."""

    READY = 0
    """The law waits at its start, torques are zero, the simulated plant stands still."""
    RUNNING = 1
    STOPPED = 2
    """Torques are zero until a reset, the plant goes on."""
    TRIPPED = 3
    """As `STOPPED`, for a reason that stands in the status."""


STATUS = np.dtype(
    [
        ("pid", "u8"),
        ("state", "u8"),
        ("trip", "u8"),
        ("law", "u8"),
        ("ticks", "u8"),
        ("missed", "u8"),
        ("alive", "f8"),
        ("worst_late", "f8"),
        ("worst_busy", "f8"),
        ("late_counts", "u8", (len(EDGES),)),
        ("busy_counts", "u8", (len(EDGES),)),
        ("reason", f"S{TEXT}"),
        ("scheduling", f"S{4 * TEXT}"),
    ]
)
"""``alive`` is the time of the last tick on the clock `time.monotonic` [s]; ``late`` is how much
later than its deadline a tick began, ``busy`` how long it took; ``scheduling`` holds a line for
each of what the system permitted and what it did not."""


def create_status(path: Path) -> Any:
    """Make the status in shared memory: one record, its fields by name."""
    return create_block(path, STATUS)[0]


def open_status(path: Path) -> Any:
    """Attach to the status that a host made."""
    return open_block(path, STATUS)[0]
