"""Many runs of a closed loop: side by side in SIMD lanes, and over threads."""

from __future__ import annotations

import os
from collections import OrderedDict
from collections.abc import Hashable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import casadi as ca
import numpy as np

from alight.errors import AlightError, UnknownName
from alight.kernels import CompilerUnavailable
from alight.kernels.lanes.kernel import Lanes, recorded_in
from alight.kernels.lanes.serial import Serial
from alight.kernels.program import Group, GroupRunner, Program
from alight.kernels.select import COMMON, Backend
from alight.kernels.toolchain import tell_once
from alight.simulation.closed_loop import (
    PLANT,
    ClosedLoop,
    InitialState,
    check_channels,
    initial_program,
    tick_program,
)
from alight.simulation.metrics import Gathering, Length, Metric, steady_first
from alight.simulation.run import KEPT, Progress
from alight.symbolic.parameters import is_parameters, structure_of
from alight.symbolic.signals import Layout

BLOCK = 4096
"""Ticks between two draws of noise."""
PART = 8192
"""Runs whose parameters and states are laid out at once: a multiple of each of `WIDTHS`."""
WIDTHS = (1, 2, 4, 8)
"""How many runs may go side by side."""


@dataclass(frozen=True)
class Runs:
    """What differs from run to run; arrays hold one run in each of their last places."""

    start: np.ndarray
    """Entries of `InitialState`, (6, n)."""
    parameters: Mapping[str, np.ndarray]
    """Values of parameters of the loop by path, (n,) or (size, n); the others are the loop's."""
    travel: np.ndarray
    """Travel of the mass from rest to set point [m], (n,)."""
    seeds: np.ndarray
    """Seeds of the sensor noise, (n,)."""

    def __len__(self) -> int:
        return self.start.shape[1]

    def part(self, some: slice) -> Runs:
        """Some of the runs."""
        parameters = {path: values[..., some] for path, values in self.parameters.items()}
        return Runs(self.start[:, some], parameters, self.travel[some], self.seeds[some])


@dataclass(frozen=True)
class Request:
    """What is wanted of a batch."""

    ticks: int
    """Samples of each run."""
    steady_state: float
    """Length of the last part, over which steady-state values are taken [s]."""
    metrics: tuple[Metric, ...]
    channels: tuple[str, ...] = ()
    """Signals to record."""
    every: int = 1
    """Ticks between two recorded samples."""
    backend: Backend = "auto"
    threads: int | None = None
    """Threads to use; one for each processor if absent."""
    width: int | None = None
    """Runs side by side, 1, 2, 4 or 8; as many as the processor has lanes if absent."""

    @property
    def samples(self) -> int:
        """Recorded samples of a run."""
        return recorded_in(0, self.ticks, self.every)


@dataclass(frozen=True)
class Outcomes:
    """How the runs of a batch went."""

    metrics: dict[str, np.ndarray]
    """By name, (n,) or (n, size)."""
    trip: np.ndarray
    """Trip code of each run, 0 where it ran to its end, (n,)."""
    ticks: np.ndarray
    """Ticks of each run before its trip, (n,)."""
    plant: np.ndarray
    """State of the plant after the last tick, (n, 7)."""
    recorded: Layout
    samples: np.ndarray
    """Recorded entries, (n, samples, columns); NaN after a trip."""


def run_batch(
    loop: ClosedLoop, runs: Runs, request: Request, progress: Progress | None = None
) -> Outcomes:
    """Run a closed loop many times; ``progress`` is told the share of the runs that is done."""
    _refuse_too_large(len(runs), request.samples * check_channels(loop, request.channels).size)
    zeros = loop.zeros().difference(runs.parameters)
    made = _prepared(loop, zeros, request)
    first, width = steady_first(request.ticks, loop.dt, request.steady_state), made.runner.width
    sizes = made.initial.numel_out(0), len(made.gathering.start)
    found = _Found.of(len(runs), *sizes, request, made.recorded)
    quiet = not np.any(runs.parameters.get(NOISE, loop.testbed.transducer.noise))

    def groups(begin: int) -> Iterator[tuple[slice, np.ndarray, np.ndarray]]:
        part = runs.part(slice(begin, begin + PART))
        p = _parameters(loop, zeros, part)
        x = np.asarray(made.initial(part.start, p))
        p = np.vstack([p, np.full(len(part), float(first)), part.travel])
        for at in range(0, len(part), width):
            own = slice(at, min(at + width, len(part)))
            yield slice(begin + own.start, begin + own.stop), x[:, own], p[:, own]

    def work(given: tuple[slice, np.ndarray, np.ndarray]) -> int:
        some, x, p = given
        group = made.runner.group(x, p, made.gathering.start)
        noise = _Noise(runs.seeds[some], width, quiet)
        found.take(some, group, _advance(made.runner, group, noise, request), request)
        return some.stop

    threads = (request.threads or os.cpu_count() or 1) if made.runner.parallel else 1
    with ThreadPoolExecutor(threads) as pool:
        for begin in range(0, len(runs), PART):
            for done in pool.map(work, groups(begin)):
                if progress is not None:
                    progress(done / len(runs))
    length = Length(loop.dt, found.ticks, np.maximum(found.ticks - first, 0))
    metrics = made.gathering.results(found.memory, length)
    plant = found.x[: PLANT.size].T
    return Outcomes(metrics, found.trip, found.ticks, plant, made.recorded, found.samples)


NOISE = "testbed.transducer.noise"
"""Path of the parameter that scales the noise of a tick."""


@dataclass(frozen=True)
class _Made:
    """What a batch runs."""

    program: Program
    initial: ca.Function
    gathering: Gathering
    recorded: Layout
    runner: GroupRunner


_made: OrderedDict[Hashable, _Made] = OrderedDict()


def _prepared(loop: ClosedLoop, zeros: frozenset[str], request: Request) -> _Made:
    """Make a program once for loops that differ in numbers only."""
    if request.backend not in COMMON:
        raise UnknownName("backend", request.backend, COMMON)
    sets = tuple(structure_of(part) for part in loop.parameters().values())
    names = tuple(metric.name for metric in request.metrics)
    key = (sets, zeros, loop.substeps, names, request.channels, request.backend, request.width)
    if not is_parameters(loop.law) or key not in _made:
        _made[key] = _make(loop, zeros, request)
        if len(_made) > KEPT:
            _made.popitem(last=False)
    _made.move_to_end(key)
    return _made[key]


def _make(loop: ClosedLoop, zeros: frozenset[str], request: Request) -> _Made:
    recorded = check_channels(loop, request.channels)
    gathering = Gathering(request.metrics)
    program = tick_program(loop, tuple({*gathering.needs, *request.channels}), zeros)
    rows = program.recorded.slices()
    entries = [i for name in recorded.signals for i in range(rows[name].start, rows[name].stop)]
    parts = program, gathering.fold(program.recorded), entries
    initial = initial_program(loop, InitialState((0.0, 0.0), 0.0), zeros)
    return _Made(program, initial, gathering, recorded, _runner(*parts, request))


def _runner(
    program: Program, fold: ca.Function, entries: list[int], request: Request
) -> GroupRunner:
    if request.backend == "vm":
        return Serial(program, fold, entries)
    try:
        return Lanes(program, fold, entries, request.width)
    except CompilerUnavailable as error:
        if request.backend != "auto":
            raise
        tell_once(f"a batch runs in CasADi's virtual machine, a thousand times slower: {error}")
        return Serial(program, fold, entries)


def _parameters(loop: ClosedLoop, zeros: frozenset[str], runs: Runs) -> np.ndarray:
    """Parameters of the program, one column for each run."""
    p = np.repeat(loop.parameter_values(zeros)[:, None], len(runs), axis=1)
    rows = loop.parameter_rows(zeros)
    for path, values in runs.parameters.items():
        p[rows[path]] = values
    return p


def _refuse_too_large(runs: int, entries: int) -> None:
    """Refuse recordings that the machine cannot hold, before hours are spent on them."""
    available = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    if 8 * runs * entries > available:
        raise AlightError(
            f"recording {entries} numbers of each of {runs} runs needs {8e-9 * runs * entries:.3g} "
            f"GB, and this machine has {available / 1e9:.3g} GB; record fewer channels, a larger "
            "`every`, or metrics alone"
        )


class _Noise:
    """Standard noise of a group of runs; the same seed gives the same noise as in a single run."""

    def __init__(self, seeds: np.ndarray, width: int, quiet: bool) -> None:
        shared = bool((seeds == seeds[0]).all())
        used = seeds[:1] if shared else seeds[np.minimum(np.arange(width), len(seeds) - 1)]
        self._sources = [np.random.default_rng(int(seed)) for seed in used]
        self._quiet = quiet

    def draw(self, ticks: int) -> np.ndarray:
        """Noise of the next ticks, (ticks, 1) if the runs share it, else (ticks, width)."""
        if self._quiet:
            return np.zeros((ticks, 1))
        return np.stack([source.standard_normal(ticks) for source in self._sources], axis=1)


def _advance(runner: GroupRunner, group: Group, noise: _Noise, request: Request) -> np.ndarray:
    """Run a group to its end, and return what was recorded."""
    parts = []
    for first in range(0, request.ticks, BLOCK):
        drawn = noise.draw(min(BLOCK, request.ticks - first))
        parts.append(runner.run(group, first, drawn, request.every))
        if not group.alive.any():
            break
    return np.concatenate(parts)


@dataclass(frozen=True)
class _Found:
    """Where the groups of a batch leave what they found."""

    memory: np.ndarray
    x: np.ndarray
    trip: np.ndarray
    ticks: np.ndarray
    samples: np.ndarray

    @classmethod
    def of(cls, runs: int, states: int, memory: int, request: Request, recorded: Layout) -> _Found:
        return cls(
            memory=np.empty((memory, runs)),
            x=np.empty((states, runs)),
            trip=np.empty(runs, dtype=int),
            ticks=np.empty(runs, dtype=int),
            samples=np.full((runs, request.samples, recorded.size), np.nan),
        )

    def take(self, some: slice, group: Group, rows: np.ndarray, request: Request) -> None:
        """Keep what a group found; only lanes that held a run of their own."""
        count = some.stop - some.start
        self.memory[:, some], self.x[:, some] = group.memory[:, :count], group.x[:, :count]
        self.trip[some], self.ticks[some] = group.trip[:count], group.done[:count]
        self.samples[some, : len(rows)] = np.moveaxis(rows[:, :, :count], 2, 0)
        moments = np.arange(request.samples) * request.every
        for run in range(some.start, some.stop):
            if self.trip[run]:  # the tick of the trip is the last one recorded
                self.samples[run, moments > self.ticks[run]] = np.nan
