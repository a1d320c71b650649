"""The files of one run."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np

from alight.cli.output import write_json
from alight.cli.summary import Summary
from alight.figures import applied_against_computed, plan_view, save
from alight.simulation import Recording


def keep(summary: Summary, folder: Path) -> None:
    """Write recordings, figures and pictures of a run, each whole or not at all.

    Raises
    ------
    AlightError
        If a file cannot be written; those before it stay.
    """
    recording = summary.recording
    recording.save(folder / "recording.parquet")
    write_json(summary.as_dict(), folder / "summary.json")
    recording.save(folder / "recording.mcap")
    drawn = _finite(recording)
    if len(drawn) > 1:
        save(plan_view(drawn, summary.scenario), folder / "plan.png")
        save(applied_against_computed(drawn), folder / "torques.png")


def _finite(recording: Recording) -> Recording:
    """Leave out what no picture can show: the sample at which a run stopped being numbers."""
    kept = np.isfinite(recording.samples).all(axis=1)
    return dataclasses.replace(recording, t=recording.t[kept], samples=recording.samples[kept])
