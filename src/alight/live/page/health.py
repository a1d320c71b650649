"""How the host fares, in the numbers that the page shows."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from alight.live.shared.status import EDGES, State

SILENT = 0.5
"""Without a tick for this long [s] the host counts as dead."""


@dataclass(frozen=True)
class Health:
    """What a status says at one moment."""

    alive: bool
    silent: float
    """Time since the last tick [s]."""
    state: State
    reason: str
    law: int
    ticks: int
    missed: int
    worst_late: float
    worst_busy: float
    late_99: float
    """Not exceeded by 99 % of the ticks [s]; the upper edge of a bin of the histogram."""
    busy_99: float
    scheduling: tuple[str, ...]


def health_of(status: Any) -> Health:
    """Read a status."""
    silent = max(time.monotonic() - float(status["alive"]), 0.0)
    lines = bytes(status["scheduling"]).decode(errors="replace").splitlines()
    return Health(
        alive=silent < SILENT,
        silent=silent,
        state=State(min(int(status["state"]), max(State))),
        reason=bytes(status["reason"]).decode(errors="replace"),
        law=int(status["law"]),
        ticks=int(status["ticks"]),
        missed=int(status["missed"]),
        worst_late=float(status["worst_late"]),
        worst_busy=float(status["worst_busy"]),
        late_99=share_below(status["late_counts"], 0.99),
        busy_99=share_below(status["busy_counts"], 0.99),
        scheduling=tuple(lines),
    )


def share_below(counts: np.ndarray, share: float) -> float:
    """Upper edge [s] of the bin up to which a share of what was counted lies; 0 without any."""
    total = np.cumsum(counts)
    if not total[-1]:
        return 0.0
    i = int(np.searchsorted(total, share * total[-1]))
    return float(EDGES[min(i + 1, len(EDGES) - 1)])
