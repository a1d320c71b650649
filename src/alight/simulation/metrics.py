"""Figures of a run that are gathered tick by tick, so that many runs need no recordings."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from alight.errors import AlightError, UnknownName
from alight.kernels.direct import Direct
from alight.simulation.recording import Recording
from alight.symbolic.build import build
from alight.symbolic.ops import Scalar, fabs, maximum, minimum, where
from alight.symbolic.signals import Layout, Signal

SETTLED = 0.05
"""A run has settled when ``e_m`` stays within this share of the travel ``x_md - x_0``."""


class Moment(NamedTuple):
    """What a metric is told of a tick beside the signals."""

    k: Scalar
    """Number of the tick, from 0."""
    steady: Scalar
    """1 in the last part of the run, in which steady-state values are taken, else 0."""
    travel: Scalar
    """Travel of the mass from rest to set point [m]."""


class Length(NamedTuple):
    """How long runs were."""

    dt: float
    """Sample time [s]."""
    ticks: np.ndarray
    """Ticks that were gathered, (n,)."""
    steady: np.ndarray
    """Those of them in the steady-state part, (n,)."""


Memory = Sequence[Any]


@dataclass(frozen=True)
class Metric:
    """A figure of a run: what it remembers from tick to tick, and what it makes of that."""

    name: str
    signal: Signal
    needs: tuple[str, ...]
    """Signals that it is made of."""
    start: tuple[float, ...]
    """Memory before the first tick."""
    fold: Callable[[Memory, Mapping[str, Any], Moment], Memory]
    """Memory after a tick, from the memory before it, the signals and the moment."""
    result: Callable[[Memory, Length], Memory]
    """The figure's entries from the memory at the end; arrays over runs."""


def _entries(value: Any, size: int) -> list[Any]:
    return [value[i] for i in range(size)] if size > 1 else [value]


# Of a maximum with NaN in its first place the lanes take the second: memory stands there, so that
# NaN is passed over as in CasADi.


def _largest(name: str, of: str, unit: str, meaning: str, size: int = 1) -> Metric:
    """Largest magnitude of a signal."""
    return Metric(
        name,
        Signal(unit, meaning, size),
        (of,),
        (0.0,) * size,
        lambda m, s, _: [maximum(fabs(v), m[i]) for i, v in enumerate(_entries(s[of], size))],
        lambda m, _: m,
    )


def _steady_largest(name: str, of: str, unit: str, meaning: str, size: int = 1) -> Metric:
    """Largest magnitude of a signal in the steady-state part."""
    return Metric(
        name,
        Signal(unit, meaning, size),
        (of,),
        (0.0,) * size,
        lambda m, s, at: [
            maximum(at.steady * fabs(v), m[i]) for i, v in enumerate(_entries(s[of], size))
        ],
        lambda m, run: [_known(v, run.steady > 0) for v in m],
    )


def _steady_mean(name: str, of: str, unit: str, meaning: str, size: int = 1) -> Metric:
    """Mean of a signal over the steady-state part."""
    return Metric(
        name,
        Signal(unit, meaning, size),
        (of,),
        (0.0,) * size,
        lambda m, s, at: [m[i] + at.steady * v for i, v in enumerate(_entries(s[of], size))],
        lambda m, run: [_known(v / np.maximum(run.steady, 1), run.steady > 0) for v in m],
    )


def _known(value: Any, when: np.ndarray) -> np.ndarray:
    """The value, NaN where it means nothing."""
    return np.where(when, value, np.nan)


def _chatter(m: Memory, run: Length) -> Memory:
    """Standard deviation over mean, from the sums of a signal and of its square."""
    count = np.maximum(run.steady, 1)
    mean = m[0] / count
    spread = np.sqrt(np.maximum(m[1] / count - mean**2, 0.0))
    return [_known(spread / np.maximum(mean, np.finfo(float).tiny), run.steady > 0)]


_METRICS = (
    _largest("peak_F_m", "F_m", "N", "largest impact force"),
    Metric(
        "impulse",
        Signal("N s", "impulse of the impact force"),
        ("F_m",),
        (0.0,),
        lambda m, s, _: [m[0] + s["F_m"]],
        lambda m, run: [m[0] * run.dt],
    ),
    Metric(
        "separations",
        Signal("", "times at which the impact force fell to zero"),
        ("F_m",),
        (0.0, 0.0),
        lambda m, s, _: [
            m[0] + where(s["F_m"] > 0, 0.0, m[1]),
            where(s["F_m"] > 0, 1.0, 0.0),
        ],
        lambda m, _: [m[0]],
    ),
    Metric(
        "chatter",
        Signal("", "standard deviation of the steady-state impact force over its mean"),
        ("F_m",),
        (0.0, 0.0),
        lambda m, s, at: [m[0] + at.steady * s["F_m"], m[1] + at.steady * s["F_m"] ** 2],
        _chatter,
    ),
    _largest("peak_tau", "tau", "N m", "largest computed torque of each joint", 2),
    Metric(
        "rms_tau",
        Signal("N m", "root mean square of the computed torque of each joint", 2),
        ("tau",),
        (0.0, 0.0),
        lambda m, s, _: [m[i] + s["tau"][i] ** 2 for i in range(2)],
        lambda m, run: [np.sqrt(v / np.maximum(run.ticks, 1)) for v in m],
    ),
    Metric(
        "clipping",
        Signal("s", "time during which the motor of each joint clips", 2),
        ("clipped",),
        (0.0, 0.0),
        lambda m, s, _: [m[i] + s["clipped"][i] for i in range(2)],
        lambda m, run: [v * run.dt for v in m],
    ),
    Metric(
        "settling",
        Signal("s", "time after which e_m stays within 5 % of the travel"),
        ("e_m",),
        (0.0,),
        lambda m, s, at: [where(fabs(s["e_m"]) > SETTLED * at.travel, at.k, m[0])],
        lambda m, run: [m[0] * run.dt],
    ),
    _steady_largest("steady_e_m", "e_m", "m", "largest steady-state error of the mass"),
    _steady_largest("steady_e_r", "e_r", "m", "largest steady-state error of the tip", 2),
    _steady_mean("mean_e_m", "e_m", "m", "mean steady-state error of the mass"),
    _steady_mean("mean_e_r", "e_r", "m", "mean steady-state error of the tip", 2),
    Metric(
        "least_clearance",
        Signal("m", "least clearance at the probe; zero or below when its plate is touched"),
        ("probe_clearance",),
        (np.finfo(float).max,),
        lambda m, s, _: [minimum(s["probe_clearance"], m[0])],
        lambda m, run: [_known(m[0], run.ticks > 0)],
    ),
)
METRICS: Mapping[str, Metric] = {metric.name: metric for metric in _METRICS}
"""Every metric, by name."""


def chosen(names: Sequence[str] | None, signals: Mapping[str, Signal]) -> tuple[Metric, ...]:
    """The named metrics, or all that the signals of a loop allow.

    Raises
    ------
    UnknownName
        If there is no such metric, or the loop lacks a signal that it is made of.
    """
    if names is None:
        return tuple(m for m in METRICS.values() if all(n in signals for n in m.needs))
    for name in names:
        if name not in METRICS:
            raise UnknownName("metric", name, METRICS)
        for needed in METRICS[name].needs:
            if needed not in signals:
                raise UnknownName(f"signal of the metric {name!r}", needed, signals)
    return tuple(METRICS[name] for name in names)


SETTINGS = ("steady_first", "travel")
"""What is told once for a run: the first tick of the steady-state part, the travel [m]."""


@dataclass(frozen=True)
class Gathering:
    """Some metrics together: one memory, one fold."""

    metrics: tuple[Metric, ...]

    @property
    def needs(self) -> tuple[str, ...]:
        """Signals that are needed, each once."""
        return tuple(dict.fromkeys(name for m in self.metrics for name in m.needs))

    @property
    def start(self) -> np.ndarray:
        """Memory before the first tick."""
        return np.array([value for m in self.metrics for value in m.start], dtype=float)

    def fold(self, recorded: Layout) -> ca.Function:
        """Build ``(memory, y, k, settings) -> memory_next`` for signals in the given layout."""
        memory = ca.SX.sym("memory", len(self.start))
        y, k = ca.SX.sym("y", recorded.size), ca.SX.sym("k")
        settings = ca.SX.sym("settings", len(SETTINGS))
        signals = recorded.unpack(y)
        at = Moment(k, where(k >= settings[0], 1.0, 0.0), settings[1])
        parts: list[Any] = []
        first = 0
        for metric in self.metrics:
            rows = [memory[first + i] for i in range(len(metric.start))]
            parts += metric.fold(rows, signals, at)
            first += len(metric.start)
        inputs: dict[str, ca.SX] = {"memory": memory, "y": y, "k": k, "settings": settings}
        return build("fold", inputs, {"memory_next": ca.vertcat(*parts)})

    def results(self, memory: np.ndarray, run: Length) -> dict[str, np.ndarray]:
        """Each metric by name, shape (n,) or (n, size), from memories of shape (size, n)."""
        found, first = {}, 0
        for metric in self.metrics:
            rows = list(memory[first : first + len(metric.start)])
            entries = [np.asarray(v) for v in metric.result(rows, run)]
            found[metric.name] = entries[0] if metric.signal.size == 1 else np.stack(entries, 1)
            first += len(metric.start)
        return found


def steady_first(ticks: int, dt: float, steady_state: float) -> int:
    """First tick of the last ``steady_state`` seconds of a run."""
    about = max(int(ticks - 1 - steady_state / dt) - 1, 0) if dt else 0
    near = np.arange(about, min(about + 4, ticks))
    return int(near[np.argmax(near * dt > (ticks - 1) * dt - steady_state)])


def metrics_of(
    recording: Recording,
    names: Sequence[str],
    *,
    dt: float,
    ticks: int,
    steady_state: float,
    travel: float,
) -> dict[str, Any]:
    """Metrics of one recorded run, folded as in a batch: floats, or arrays of their entries.

    Parameters
    ----------
    recording : Recording
        Of every tick; the one at which a run tripped is not counted.
    names : sequence of str
        Metrics out of `METRICS`.
    dt : float
        Sample time of the run [s].
    ticks : int
        Length that the run should have had.
    steady_state : float
        Length of the last part, over which steady-state values are taken [s].
    travel : float
        Travel of the mass from rest to set point [m].

    Raises
    ------
    AlightError
        If ticks are missing from the recording: sums and peaks would be wrong.
    UnknownName
        If there is no such metric, or the recording lacks a signal that it is made of.
    """
    if not np.allclose(np.diff(recording.t), dt, rtol=1e-3, atol=0):
        raise AlightError("metrics need a recording of every tick; record with every = 1")
    gathering = Gathering(chosen(names, recording.layout.signals))
    layout = Layout({name: recording.layout.signals[name] for name in gathering.needs})
    first = steady_first(ticks, dt, steady_state)
    count = len(recording) - (not recording.verdict.completed)
    columns = [recording[name].reshape(len(recording), -1)[:count] for name in layout.signals]
    block = _block(tuple(names), tuple(layout.signals.items()))
    memory = _gathered(block, gathering.start, np.hstack(columns), (float(first), travel))
    length = Length(dt, np.array([count]), np.array([max(count - first, 0)]))
    found = gathering.results(memory[:, None], length)
    return {name: float(v[0]) if v.ndim == 1 else v[0] for name, v in found.items()}


BLOCK = 256
"""Ticks in one call of the virtual machine."""


@functools.lru_cache(maxsize=32)
def _block(names: tuple[str, ...], signals: tuple[tuple[str, Signal], ...]) -> Direct:
    """The fold over a block of ticks."""
    layout = Layout(dict(signals))
    fold = Gathering(chosen(names, layout.signals)).fold(layout)
    return Direct(fold.mapaccum("gather", BLOCK))


def _gathered(
    block: Direct, memory: np.ndarray, rows: np.ndarray, settings: tuple[float, float]
) -> np.ndarray:
    """Memory after all rows, of which the last block is filled up."""
    given = np.tile(settings, BLOCK)
    for first in range(0, len(rows), BLOCK):
        part = rows[first : first + BLOCK]
        filled = np.zeros((BLOCK, rows.shape[1]))
        filled[: len(part)] = part
        (after,) = block(memory, filled.ravel(), np.arange(first, first + BLOCK), given)
        memory = after.reshape(BLOCK, -1)[len(part) - 1]
    return memory
