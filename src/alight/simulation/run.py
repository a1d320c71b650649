"""One run of a closed loop."""

from __future__ import annotations

import os
from collections import OrderedDict
from collections.abc import Callable, Hashable

import numpy as np

from alight.control.law import Law, PlainLaw
from alight.control.measurement import Measurement
from alight.errors import AlightError
from alight.kernels import Auto, Runner, runner
from alight.kernels.direct import Direct
from alight.kernels.select import Backend
from alight.simulation.closed_loop import (
    MEASURED,
    NO_TORQUE,
    PLANT,
    SENSORS,
    ClosedLoop,
    InitialState,
    check_channels,
    plain_programs,
    tick_program,
    torque_signals,
)
from alight.simulation.ending import ending
from alight.simulation.recording import Recording
from alight.simulation.verdict import Outcome, Verdict
from alight.symbolic.parameters import is_parameters, structure_of
from alight.symbolic.signals import Layout

BLOCK = 2048
"""Ticks between two reports of progress."""

Progress = Callable[[float], None]
"""Told the share of the run that is done."""


def run(
    loop: ClosedLoop,
    start: InitialState,
    duration: float,
    *,
    seed: int = 0,
    channels: tuple[str, ...] | None = None,
    every: int = 1,
    backend: Backend = "auto",
    progress: Progress | None = None,
) -> Recording:
    """Run a closed loop from a start and record its signals.

    Parameters
    ----------
    loop : ClosedLoop
        Plant, testbed and law.
    start : InitialState
        Joint angles [rad] and position of the mass [m] at the first sample.
    duration : float
        Length of the run [s].
    seed : int
        Seed of the sensor noise; the same seed gives the same run on every backend.
    channels : tuple of str, optional
        Signals to record; all of them if absent.
    every : int
        Ticks between two recorded samples; the last sample of a run that ends early is recorded
        in any case.
    backend : {"auto", "vm", "c", "lanes"}
        See `alight.kernels.runner`; a law in plain Python does not use it.
    progress : callable, optional
        Called now and then with the share that is done.

    Returns
    -------
    Recording
        Up to the end, or up to the sample at which the run ended early; see its ``verdict``.

    Raises
    ------
    AlightError
        If ``every`` is not 1 or more, or the recording does not fit into memory.
    """
    if every < 1:
        raise AlightError(f"every = {every}: must be 1 or more")
    ticks = max(round(duration / loop.dt), 1)
    noise = np.random.default_rng(seed)
    made: Runner
    if isinstance(loop.law, PlainLaw):
        check_channels(loop, channels)
        made, recorded = _PlainLoop(loop, loop.law), Layout(loop.signals)
    else:
        made, recorded = _prepared(loop, channels, backend)
        if isinstance(made, Auto):
            made.expect(ticks)
    _refuse_too_long(-(-ticks // every), recorded.size + 1)
    x, p = loop.initial_column(start), loop.parameter_values(loop.zeros())
    samples = np.empty((-(-ticks // every) + 1, recorded.size + 1))  # one more for an early end
    numbers, filled = np.empty(len(samples)), 0
    for first in range(0, ticks, BLOCK):
        block = noise.standard_normal(min(BLOCK, ticks - first))
        x, y = made.run(x, block, p)
        ended = bool(len(y) < len(block) or y[-1, -1] or not np.isfinite(y[-1]).all())
        passed = first + np.arange(len(y))
        kept = passed % every == 0
        kept[-1] |= ended
        count = filled + int(kept.sum())
        samples[filled:count], numbers[filled:count], filled = y[kept], passed[kept], count
        if progress is not None:
            progress(min(first + len(y), ticks) / ticks)
        if ended:
            break
    verdict = _verdict(y[-1], float(passed[-1] * loop.dt), recorded, loop.law, x[: PLANT.size])
    t = numbers[:filled] * loop.dt
    recording = Recording(t, samples[:filled, :-1], recorded, verdict)
    if isinstance(loop.law, PlainLaw) and channels is not None:
        return select(recording, channels)
    return recording


def _refuse_too_long(samples: int, columns: int) -> None:
    """Refuse a recording that the machine cannot hold, before hours are spent on it."""
    needed = 8 * samples * columns
    available = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    if needed > available:
        raise AlightError(
            f"a recording of {samples:.3g} samples of {columns} columns needs "
            f"{needed / 1e9:.3g} GB, and this machine has {available / 1e9:.3g} GB; set a shorter "
            "duration, or record fewer channels, or at a larger `every`"
        )


_made: OrderedDict[Hashable, tuple[Runner, Layout]] = OrderedDict()
KEPT = 32
"""Programs kept ready in a process; the least recently used goes first."""


def _prepared(
    loop: ClosedLoop, channels: tuple[str, ...] | None, backend: Backend
) -> tuple[Runner, Layout]:
    """Build a loop once: loops that differ in numbers other than zero share one program."""
    sets = tuple(structure_of(part) for part in loop.parameters().values())
    key = (sets, loop.zeros(), loop.substeps, channels, backend)
    known = is_parameters(loop.law)  # any other law may hold other numbers in the next run
    if not known or key not in _made:
        program = tick_program(loop, channels, loop.zeros())
        _made[key] = runner(program, backend), program.recorded
        if len(_made) > KEPT:
            _made.popitem(last=False)
    _made.move_to_end(key)
    return _made[key]


def select(recording: Recording, channels: tuple[str, ...]) -> Recording:
    """The recording of the given signals only."""
    layout = Layout({n: s for n, s in recording.layout.signals.items() if n in channels})
    columns = [recording[name].reshape(len(recording), -1) for name in layout.signals]
    return Recording(recording.t, np.hstack(columns), layout, recording.verdict, recording.scenario)


def _verdict(row: np.ndarray, end: float, recorded: Layout, law: Law, plant: np.ndarray) -> Verdict:
    """Read off the last row, and the state of the plant after it, how the run ended."""
    code = int(row[-1]) if np.isfinite(row[-1]) else 0
    strange = ~np.isfinite(row[:-1])
    if not code and strange.any():
        name = recorded.columns[int(np.argmax(strange))]
        return Verdict(Outcome.NOT_FINITE, end, name, "it is infinite or not a number")
    return ending(code, end, law, plant)


class _PlainLoop:
    """Runs a law in ordinary Python: CasADi for the plant, one Python call for each tick."""

    name = "python"

    def __init__(self, loop: ClosedLoop, law: PlainLaw) -> None:
        self._loop, self._law = loop, law
        self._sense, self._move = (
            Direct(program) for program in plain_programs(loop, loop.zeros())
        )
        self._recorded = Layout(loop.law_signals)
        self._state = dict(law.initial_state())

    def run(self, x: np.ndarray, w: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Run as many ticks as ``w`` has entries; see `Runner`."""
        rows = []
        for noise in w:
            x, row = self._tick(x, float(noise), p)
            rows.append(row)
            if row[-1] or not np.isfinite(row).all():
                break
        return x, np.array(rows)

    def _tick(self, x: np.ndarray, noise: float, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        plant, before, held = np.split(x, [PLANT.size, PLANT.size + SENSORS.size])
        now, seen = self._sense(plant, before, noise, p)
        measured = Measurement(**MEASURED.unpack(seen))
        tick = self._law.tick(self._state, measured, self._loop.dt)
        clipped = self._loop.testbed.motors.clip(np.asarray(tick.tau, dtype=float))
        applied = held if self._loop.testbed.delay else clipped
        following, signals, trip = self._move(plant, applied, p)
        torque = torque_signals(tick.tau, clipped)
        own = self._recorded.pack({**tick.signals, **self._state, **torque})
        lost = 0.0 if np.isfinite(tick.tau).all() else float(NO_TORQUE)
        row = np.concatenate([signals, seen, own, [tick.trip or lost or trip[0]]])
        self._state = dict(tick.state)
        return np.concatenate([following, now, clipped if self._loop.testbed.delay else []]), row
