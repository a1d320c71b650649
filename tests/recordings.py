"""A small recording, and what it means that two are the same."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from alight import Outcome, Recording, Verdict
from alight.symbolic.signals import Layout, Signal

FORMATS = ("parquet", "mcap")
each_format = pytest.mark.parametrize("suffix", FORMATS)


def small(n: int = 4, **changes: Any) -> Recording:
    layout = Layout({"q": Signal("rad", "joint angles", 2), "F_m": Signal("N", "impact force")})
    rng = np.random.default_rng(1)
    made = Recording(
        t=np.arange(n) * 5e-4,
        samples=rng.standard_normal((n, 3)),
        layout=layout,
        verdict=Verdict(Outcome.DIVERGED, 1.5e-3, "q1", "gains"),
        scenario={"duration": 1.0, "plant": {"K_I": 1e5}},
    )
    return dataclasses.replace(made, **changes)


def assert_same(loaded: Recording, saved: Recording) -> None:
    assert loaded.t.tobytes() == saved.t.tobytes()
    assert loaded.samples.shape == saved.samples.shape
    assert loaded.samples.tobytes() == saved.samples.tobytes()
    assert loaded.layout == saved.layout
    assert list(loaded.layout.signals) == list(saved.layout.signals)
    assert loaded.verdict == saved.verdict
    assert loaded.scenario == saved.scenario
    assert loaded.events == saved.events
    assert loaded.bench == saved.bench
