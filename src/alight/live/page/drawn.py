"""What the plan view needs besides the columns of a row, from the equations of the models."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np

from alight.live.page.source import Source
from alight.symbolic.signals import Layout, Signal

DRAWN = {
    "elbow": Signal("m", "position of the elbow", 2),
    "deflection": Signal("m", "deflection of the stiff spring"),
}


class Drawn:
    """A source whose rows also hold `DRAWN`; NaN where what they follow from is not recorded."""

    def __init__(self, source: Source) -> None:
        self.source = source
        self.mode, self.scenario, self.dt = source.mode, source.scenario, source.dt

    @cached_property
    def layout(self) -> Layout:
        """What a row holds."""
        return Layout({**self.source.layout.signals, **DRAWN})

    @property
    def head(self) -> int:
        """Number of rows there are up to now."""
        return self.source.head

    def read(self, first: int, most: int | None = None) -> tuple[int, np.ndarray]:
        """Rows as those of the source, with what is drawn behind."""
        first, rows = self.source.read(first, most)
        plant, q, gap = self.scenario.plant, self._of("q", rows), self._of("gap", rows)[:, 0]
        elbow = np.asarray(plant.arm.elbow(q.T), dtype=float).T
        deflection = np.asarray(plant.contact.penetration(gap), dtype=float)
        return first, np.column_stack([rows, elbow, deflection])

    def events(self, since: int) -> Sequence[Any]:
        """What happened, as the source tells it."""
        return self.source.events(since)

    def _of(self, name: str, rows: np.ndarray) -> np.ndarray:
        signals = self.source.layout.signals
        if name not in signals:
            return np.full((len(rows), 2), np.nan)
        return rows[:, self.source.layout.slices()[name]]
