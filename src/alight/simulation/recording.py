"""The signals of one run, by name, with units."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from alight.errors import UnknownName
from alight.simulation.recording_events import Event
from alight.simulation.verdict import Verdict
from alight.symbolic.signals import Layout


@dataclass(frozen=True)
class Recording:
    """What one run recorded.

    ``recording["e_r"]`` is an (n, 2) array, ``recording["e_r1"]`` its first column;
    ``recording["e_m"]`` is an (n,) array. Units are SI and stand in ``recording.units``.
    """

    t: np.ndarray
    """Time of each sample [s], shape (n,)."""
    samples: np.ndarray
    """One row per sample, one column per scalar, in the order of ``columns``."""
    layout: Layout
    verdict: Verdict
    scenario: Mapping[str, Any] = field(default_factory=dict)
    """The scenario that was run, as plain data."""
    events: tuple[Event, ...] = ()
    """What happened in the course of the run: on the live bench, changes made by hand and trips."""
    bench: Mapping[str, Any] = field(default_factory=dict)
    """How the live bench stood when the run began, as plain data; empty for a simulation."""

    @property
    def columns(self) -> tuple[str, ...]:
        """Name of each scalar signal."""
        return self.layout.columns

    @property
    def units(self) -> dict[str, str]:
        """Unit of each scalar signal."""
        return dict(zip(self.columns, self.layout.units, strict=True))

    def __len__(self) -> int:
        return len(self.t)

    def __contains__(self, name: str) -> bool:
        return name in self.layout.signals or name in self.columns

    def __getitem__(self, name: str) -> np.ndarray:
        if name in self.layout.signals:
            rows = self.samples[:, self.layout.slices()[name]]
            return rows[:, 0] if rows.shape[1] == 1 else rows
        if name in self.columns:
            return self.samples[:, self.columns.index(name)]
        raise UnknownName("signal", name, (*self.layout.signals, *self.columns))

    def last(self, seconds: float) -> Recording:
        """The part of the recording within ``seconds`` of its end."""
        start = self.t[-1] - seconds
        kept = self.t > start
        return dataclasses.replace(
            self,
            t=self.t[kept],
            samples=self.samples[kept],
            events=tuple(event for event in self.events if event.t > start),
        )

    def peak(self, name: str) -> Any:
        """Largest magnitude of a signal: a float, or one for each entry of a vector."""
        found = np.abs(self[name]).max(axis=0)
        return float(found) if np.ndim(found) == 0 else found

    def save(self, path: str | Path) -> None:
        """Save as ``.parquet`` or ``.mcap``; `alight.simulation.recording_files` says what of it.

        Raises
        ------
        FileError
            If the suffix is another one, or the file cannot be written.
        """
        from alight.simulation.recording_files import save

        save(self, path)

    @staticmethod
    def load(path: str | Path) -> Recording:
        """Load what `save` or the live bench saved, exact to the bit.

        A recording of the live bench that was cut off by a kill or by the end of the power opens
        up to there, and its ``verdict`` says so; one that goes on in files beside it is joined.

        Raises
        ------
        FileError
            If the file cannot be read, is damaged, or holds no recording.
        """
        from alight.simulation.recording_files import load

        return load(path)

    def to_pandas(self) -> Any:
        """The recording as a pandas ``DataFrame`` with the time as its index."""
        import pandas as pd

        return pd.DataFrame(
            self.samples, columns=list(self.columns), index=pd.Index(self.t, name="t")
        )
