"""Times of two things by turns, and their ratio: a drift of the clock hits both."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

GRAIN = 0.05
"""Seconds below which a sample is made of several calls."""

LONG = 10.0
"""Seconds of a call beyond which two samples must do."""


@dataclass(frozen=True)
class Pace:
    """How long to measure, and on how much."""

    seconds: float
    """For each ratio, roughly [s]."""
    least: int
    """Samples of each ratio, at least."""
    most: int
    sampled: float
    """Length of a run of a peer whose time grows with the number of its samples [s]."""
    batch: float
    """Length of the runs of a batch of a peer [s]."""
    runs: int
    """Runs in a batch of Alight."""
    ticks_of_law: int
    accuracy: float
    """Length of the runs whose error is shown [s]."""


FULL = Pace(2.5, 3, 15, 1.0, 0.1, 1000, 200_000, 1.0)
QUICK = Pace(0.3, 1, 3, 0.1, 0.02, 64, 20_000, 0.1)


@dataclass(frozen=True)
class Work:
    """Something to be timed, and how much of it one call does."""

    call: Callable[[], Any]
    amount: float = 1.0
    """In seconds of simulated time over all runs, say: the same for both parts of a ratio."""
    prepared: bool = False
    """Whether all that is done once is done: then a first call that takes long counts."""


class Kept:
    """Something to be called, and what its latest call returned."""

    def __init__(self, run: Callable[[], Any]) -> None:
        self._run = run
        self.latest: Any = None

    def __call__(self) -> None:
        """Call it."""
        self.latest = self._run()


def ratios(
    samples: Sequence[float], bases: Sequence[float], amount: float = 1.0, base: float = 1.0
) -> list[float]:
    """Ratio of each time per amount to the mean of those of the base before and after it.

    Parameters
    ----------
    samples : sequence of float
        Times [s].
    bases : sequence of float
        Times of the base [s]: one before each sample, and one after the last.
    amount, base : float
        How much a sample, and a time of the base, stands for.
    """
    if len(bases) != len(samples) + 1 or not samples:
        raise ValueError(f"{len(samples)} samples need one base more, and have {len(bases)}")
    around = ((a + b) / 2 for a, b in pairwise(bases))
    return [(s / amount) / (b / base) for s, b in zip(samples, around, strict=True)]


def spread(values: Sequence[float]) -> dict[str, float]:
    """Median, least and greatest of some values, and how many there are."""
    return {
        "median": statistics.median(values),
        "low": min(values),
        "high": max(values),
        "count": len(values),
    }


def compared(work: Work, base: Work, pace: Pace) -> dict[str, dict[str, float]]:
    """Ratio of two works by turns, and the time that one call of each takes [s]."""
    samples, bases = _by_turns(work, base, pace)
    return {
        "ratio": spread(ratios(samples, bases, work.amount, base.amount)),
        "seconds": spread(samples),
        "base": spread(bases),
    }


def _by_turns(work: Work, base: Work, pace: Pace) -> tuple[list[float], list[float]]:
    calls = _calls(base)
    bases = [_seconds(base, calls)]
    if not work.prepared:
        work.call()
        bases = [_seconds(base, calls)]
    first = _seconds(work, 1)  # warms up, and counts where that is nothing of it
    samples = [first] if first > pace.seconds / 2 else []
    bases.append(_seconds(base, calls))
    if not samples:
        del bases[0]
    own = max(1, round(GRAIN / first))
    least = pace.least if first < LONG else min(pace.least, 2)
    wished = round(pace.seconds / (first * own + bases[-1] * calls))
    while len(samples) < min(max(wished, least), pace.most):
        samples.append(_seconds(work, own))
        bases.append(_seconds(base, calls))
    return samples, bases


def _calls(work: Work) -> int:
    work.call()
    return max(1, round(GRAIN / _seconds(work, 1)))


def _seconds(work: Work, calls: int) -> float:
    """Time of one call out of several in a row."""
    began = time.perf_counter()
    for _ in range(calls):
        work.call()
    return (time.perf_counter() - began) / calls
