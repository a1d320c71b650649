"""A run of a batch is the single run, whatever runs beside it."""

from __future__ import annotations

import dataclasses
from concurrent.futures import ThreadPoolExecutor
from functools import cache

import numpy as np
import pytest

from alight.errors import AlightError, UnknownName
from alight.simulation import batch
from alight.simulation.batch import BLOCK, Outcomes, Request, Runs, run_batch
from alight.simulation.closed_loop import DIVERGED, NO_TORQUE, ClosedLoop, InitialState
from alight.simulation.ending import ending
from alight.simulation.metrics import METRICS, steady_first
from alight.simulation.recording import Recording
from alight.simulation.run import run
from alight.symbolic.parameters import rebind
from tests.compiler import has_compiler
from tests.simulation.figures import expected
from tests.simulation.pushing import TRAVEL, TRIP, begin, pushing, request, runs_of

pytestmark = pytest.mark.skipif(not has_compiler(), reason="no C compiler on this machine")

WIDTHS = (1, 2, 4, 8)
EVERY_WIDTH = pytest.mark.parametrize("width", WIDTHS)
LOOP = pushing()
CHANNELS = ("q", "x_m", "F_m", "tau")
RECORDED = (*CHANNELS, "clipped", "e_m", "e_r", "probe_clearance", "count", "root", "x_m_measured")
"""The same in nearly all tests, so that few kernels are compiled."""
COUNT = 11
"""Runs: more than one group in every width, and no multiple of any."""
TICKS = 2 * BLOCK + 300
NEVER = 1e9
ROUNDING = 1e-9
"""How far runs of other widths may lie apart, relative to the largest value of a signal.

Rounding differs (products and sums are contracted, quotients are made otherwise) and grows through
the impact: to 1e-12 here. Where it moves a measured value to the next step of a quantiser, which is
seldom, it grows to `STEP`.
"""
STEP = 1e-4
"""The same where a quantiser took the next step for a while: a count of the transducers is 1e-6 m,
through the backward difference 2 mm/s."""


def varied() -> Runs:
    rng = np.random.default_rng(0)
    return runs_of(
        LOOP,
        COUNT,
        plant__body__m=rng.uniform(1.2, 1.8, COUNT),
        plant__contact__K_I=rng.uniform(1e4, 3e4, COUNT),
        law__trip_at=np.full(COUNT, NEVER),
        law__torque_until=np.full(COUNT, NEVER),
        law__real_until=np.full(COUNT, NEVER),
        law__hole=np.full(COUNT, NEVER),
    )


def with_parameters(runs: Runs, **changes: np.ndarray) -> Runs:
    named = {path.replace("__", "."): values for path, values in changes.items()}
    return dataclasses.replace(runs, parameters={**runs.parameters, **named})


def one(runs: Runs, i: int | list[int] | np.ndarray) -> Runs:
    """Some runs by themselves."""
    at = np.atleast_1d(i)
    numbers = {path: values[..., at] for path, values in runs.parameters.items()}
    return Runs(runs.start[:, at], numbers, runs.travel[at], runs.seeds[at])


def single_loop(runs: Runs, i: int) -> ClosedLoop:
    """The loop of one run, its numbers put in one by one."""
    loop = LOOP
    for path, values in runs.parameters.items():
        *owners, name = path.split(".")
        chain = [loop]
        for owner in owners:
            chain.append(getattr(chain[-1], owner))
        made = rebind(chain[-1], **{name: float(values[i])})
        for parent, owner in zip(chain[-2::-1], owners[::-1], strict=True):
            made = rebind(parent, **{owner: made})
        loop = made
    return loop


def single(runs: Runs, i: int, ticks: int) -> Recording:
    q1, q2, x_m, q1_dot, q2_dot, x_m_dot = runs.start[:, i]
    start = InitialState((q1, q2), x_m, (q1_dot, q2_dot), x_m_dot)
    loop = single_loop(runs, i)
    return run(loop, start, ticks * LOOP.dt, seed=int(runs.seeds[i]), backend="c")


@cache
def singles() -> list[Recording]:
    return [single(varied(), i, TICKS) for i in range(COUNT)]


@cache
def outcomes(width: int) -> Outcomes:
    return run_batch(LOOP, varied(), request(LOOP, TICKS, channels=RECORDED, every=7, width=width))


def recorded(found: Outcomes, name: str) -> np.ndarray:
    entries = found.samples[:, :, found.recorded.slices()[name]]
    return entries[:, :, 0] if entries.shape[2] == 1 else entries


def same(a: Outcomes, b: Outcomes) -> bool:
    """Equal to the bit."""
    arrays = [(a.metrics[name], b.metrics[name]) for name in a.metrics]
    arrays += [(a.trip, b.trip), (a.ticks, b.ticks), (a.plant, b.plant), (a.samples, b.samples)]
    return all(np.array_equal(x, y, equal_nan=True) for x, y in arrays)


def picked(found: Outcomes, at: np.ndarray) -> Outcomes:
    metrics = {name: values[at] for name, values in found.metrics.items()}
    parts = found.trip[at], found.ticks[at], found.plant[at]
    return Outcomes(metrics, *parts, found.recorded, found.samples[at])


def figures(recording: Recording, ticks: int, count: int | None = None) -> dict[str, np.ndarray]:
    """Metrics from the single run's recording."""
    names = {name for metric in METRICS.values() for name in metric.needs}
    known = names & set(recording.layout.signals)
    first = steady_first(ticks, LOOP.dt, ticks * LOOP.dt / 3)
    rows = slice(0, len(recording) if count is None else count)
    signals = {name: recording[name][rows] for name in known}
    return expected(signals, dt=LOOP.dt, first=first, travel=TRAVEL)


# The same runs


def test_the_runs_settle_in_contact_with_noise_and_quantisation_at_work():
    for recording in singles():
        late = recording["F_m"][-1000:]
        assert recording.verdict.completed and late.min() > 1.0
        assert abs(recording["q_dot"][-1000:]).max() < 0.02
        assert recording["x_m_measured"][-1000:].std() > 0


@EVERY_WIDTH
def test_states_and_forces_are_those_of_the_single_run(width):
    for name in CHANNELS:
        alone = np.array([recording[name][::7] for recording in singles()])
        beside = recorded(outcomes(width), name)
        assert alone.shape == beside.shape
        apart = [abs(a - b).max() / abs(a).max() for a, b in zip(alone, beside, strict=True)]
        assert np.max(apart) <= STEP and np.median(apart) <= ROUNDING, name


@EVERY_WIDTH
def test_metrics_are_those_of_the_single_run(width):
    found = outcomes(width).metrics
    alone = [figures(recording, TICKS) for recording in singles()]
    assert alone[0].keys() == found.keys()
    for name, values in found.items():
        single_values = np.array([told[name] for told in alone])
        apart = abs(values - single_values) / max(abs(single_values).max(), 1e-12)
        # The spread of the force is a difference of sums: half the digits are left.
        rounding = 1e-6 if name == "chatter" else ROUNDING
        assert apart.max() <= STEP and np.median(apart) <= rounding, name


@EVERY_WIDTH
def test_metrics_are_those_of_what_the_batch_records_itself(width):
    needed = ("F_m", "tau", "clipped", "e_m", "e_r", "probe_clearance")
    ticks = BLOCK + 100
    found = run_batch(LOOP, varied(), request(LOOP, ticks, channels=RECORDED, width=width))
    first = steady_first(ticks, LOOP.dt, ticks * LOOP.dt / 3)
    for i in range(COUNT):
        signals = {name: recorded(found, name)[i] for name in needed}
        told = expected(signals, dt=LOOP.dt, first=first, travel=TRAVEL)
        for name, value in told.items():
            # The spread of the force is a difference of sums: half the digits are left.
            loose = {"rtol": 1e-12, "atol": 1e-6 if name == "chatter" else 1e-12}
            assert np.allclose(found.metrics[name][i], value, **loose), name


def test_the_virtual_machine_gives_the_same():
    some, ticks = one(varied(), [0, 1]), 1500
    asked = {"channels": RECORDED, "every": 7}
    vm = run_batch(LOOP, some, request(LOOP, ticks, backend="vm", **asked))
    lanes = run_batch(LOOP, some, request(LOOP, ticks, **asked))
    assert np.array_equal(vm.ticks, lanes.ticks)
    for name in CHANNELS:
        a, b = recorded(vm, name), recorded(lanes, name)
        assert a.shape == b.shape and abs(a - b).max() <= STEP * abs(a).max()
    for name, values in vm.metrics.items():
        assert np.allclose(lanes.metrics[name], values, rtol=STEP, atol=1e-7), name
    alone = single(some, 1, ticks)  # in the virtual machine the bits are those of the single run
    assert np.array_equal(recorded(vm, "q")[1], alone["q"][::7])


# Whatever runs beside it


@EVERY_WIDTH
def test_the_order_of_the_runs_changes_no_bit(width):
    order = np.random.default_rng(1).permutation(COUNT)
    asked = request(LOOP, TICKS, channels=RECORDED, every=7, width=width)
    assert same(run_batch(LOOP, one(varied(), order), asked), picked(outcomes(width), order))


@EVERY_WIDTH
def test_a_run_by_itself_has_the_same_bits(width):
    asked = request(LOOP, TICKS, channels=RECORDED, every=7, width=width)
    alone = run_batch(LOOP, one(varied(), 4), asked)
    assert same(alone, picked(outcomes(width), np.array([4])))


@pytest.mark.parametrize("threads", [2, 3, None])
def test_the_number_of_threads_changes_no_bit(threads):
    asked = request(LOOP, TICKS, channels=RECORDED, every=7, width=2, threads=threads)
    assert same(run_batch(LOOP, varied(), asked), outcomes(2))


def troubled() -> Runs:
    """Every second run ends in one of all ways; the others go on."""
    runs = varied()
    start, trip, torque = runs.start.copy(), np.full(COUNT, NEVER), np.full(COUNT, NEVER)
    trip[1] = 5
    start[5, 3] = 1e9  # the body is shot off
    torque[5] = 40
    start[:, 7] = np.nan
    trip[9] = BLOCK + 2
    moved = dataclasses.replace(runs, start=start)
    return with_parameters(moved, law__trip_at=trip, law__torque_until=torque)


@EVERY_WIDTH
def test_neighbours_that_trip_diverge_or_are_nan_change_no_bit(width):
    asked = request(LOOP, TICKS, channels=RECORDED, every=7, width=width)
    found = run_batch(LOOP, troubled(), asked)
    sound = np.arange(0, COUNT, 2)
    assert same(picked(found, sound), picked(outcomes(width), sound))


# Ends


def test_each_run_ends_alone_with_the_code_time_and_cause_of_the_single_run():
    runs = troubled()
    for backend in ("c", "vm"):
        asked = request(LOOP, BLOCK + 10, channels=RECORDED, backend=backend)
        found = run_batch(LOOP, runs, asked)
        assert found.trip[1::2].tolist() == [TRIP, DIVERGED, NO_TORQUE, NO_TORQUE, TRIP]
        assert found.ticks[[1, 5, 9]].tolist() == [5, 41, BLOCK + 2]
        assert (found.trip[::2] == 0).all() and (found.ticks[::2] == BLOCK + 10).all()
        for i in (1, 3, 5, 9):
            alone = single(runs, i, BLOCK + 10)
            end = float(found.ticks[i] * LOOP.dt)
            verdict = ending(int(found.trip[i]), end, LOOP.law, found.plant[i])
            assert verdict.outcome == alone.verdict.outcome
            assert (verdict.time, verdict.cause) == (alone.verdict.time, alone.verdict.cause)


@EVERY_WIDTH
@pytest.mark.parametrize("every", [1, 7, BLOCK + 1])
def test_channels_hold_the_tick_of_the_trip_and_nan_after_it(width, every):
    last = np.array([0, 1, 6, 7, 8, BLOCK - 1, BLOCK, BLOCK + 1, BLOCK + 7, NEVER, 14])
    runs = with_parameters(varied(), law__trip_at=last)
    ticks = BLOCK + 20
    asked = request(LOOP, ticks, channels=RECORDED, every=every, width=width)
    found = run_batch(LOOP, runs, asked)
    assert np.array_equal(found.ticks, np.minimum(last, ticks))
    assert np.array_equal(found.trip, np.where(last < ticks, TRIP, 0))
    moments = np.arange(0, ticks, every)
    there = moments <= last[:, None]
    counts = recorded(found, "count")
    assert np.array_equal(np.isfinite(counts), there)
    assert np.array_equal(counts[there], np.broadcast_to(moments, there.shape)[there])


def test_metrics_of_a_run_that_trips_are_those_of_the_ticks_before_it():
    last = np.array([0, 1, 2, 30, 200, 700, BLOCK + 1, 999, NEVER, 3, 1500])
    runs = with_parameters(varied(), law__trip_at=last)
    ticks = BLOCK + 20
    found = {
        b: run_batch(LOOP, runs, request(LOOP, ticks, channels=RECORDED, backend=b))
        for b in ("c", "vm")
    }
    for i in range(COUNT):
        alone = figures(single(runs, i, ticks), ticks, int(min(last[i], ticks)))
        for name, value in alone.items():
            for each in found.values():
                told = each.metrics[name][i]
                close = np.allclose(told, value, rtol=STEP, atol=1e-7, equal_nan=True)
                assert close, (name, i)


def test_a_signal_that_is_no_number_ends_no_run_and_stays_out_of_the_others():
    root = np.where(np.arange(COUNT) % 2 == 0, 100.0, NEVER)
    runs = with_parameters(varied(), law__real_until=root)
    for backend in ("c", "vm"):
        found = run_batch(LOOP, runs, request(LOOP, 300, channels=RECORDED, backend=backend))
        assert (found.trip == 0).all()
        lost = np.isnan(recorded(found, "root"))
        assert np.array_equal(lost, (np.arange(300) > root[:, None]))


@pytest.mark.parametrize("backend", ["c", "vm"])
def test_one_value_that_is_no_number_does_not_hide_a_peak(backend):
    hole = np.where(np.arange(COUNT) % 2 == 0, 250.0, NEVER)
    runs = with_parameters(varied(), law__hole=hole)
    found = run_batch(LOOP, runs, request(LOOP, 300, channels=RECORDED, backend=backend))
    late = recorded(found, "e_m")[:, steady_first(300, LOOP.dt, 300 * LOOP.dt / 3) :]
    assert np.isnan(late).any(axis=1).tolist() == (hole < NEVER).tolist()
    assert np.array_equal(found.metrics["steady_e_m"], np.nanmax(abs(late), axis=1))


# Noise


def test_runs_with_one_seed_share_their_noise_and_runs_with_others_do_not():
    runs = one(varied(), [0] * 8)
    asked = request(LOOP, 400, channels=RECORDED)
    shared = run_batch(LOOP, dataclasses.replace(runs, seeds=np.full(8, 5)), asked)
    own = run_batch(LOOP, dataclasses.replace(runs, seeds=np.arange(8)), asked)
    heard = recorded(shared, "x_m_measured")
    assert (heard == heard[0]).all()
    assert np.array_equal(heard[0], recorded(own, "x_m_measured")[5])
    assert len(np.unique(recorded(own, "x_m_measured"), axis=0)) == 8


def test_without_noise_seeds_mean_nothing():
    still = pushing(noise=0.0)
    runs = runs_of(still, 9, plant__body__m=np.full(9, 1.5))
    found = run_batch(still, runs, request(still, 100, channels=("x_m_measured",)))
    assert (found.samples == found.samples[0]).all()
    alone = run(still, begin(still), 100 * still.dt, seed=3, backend="c")
    measured = alone["x_m_measured"]
    assert np.allclose(found.samples[3, :, 0], measured, rtol=1e-12, atol=1e-6)


# What is asked for


def test_progress_rises_to_one():
    shares: list[float] = []
    run_batch(LOOP, varied(), request(LOOP, 50, channels=RECORDED, width=2), shares.append)
    assert shares == sorted(shares) and shares[-1] == 1.0 and len(shares) == -(-COUNT // 2)


def test_recordings_that_no_memory_holds_are_refused_before_anything_runs():
    runs = one(varied(), [0] * 4)
    asked = Request(10**12, 1.0, request(LOOP, 1).metrics, ("q",), 1, "vm")
    with pytest.raises(AlightError, match="record fewer channels, a larger `every`, or metrics"):
        run_batch(LOOP, runs, asked)


def test_an_unknown_backend_is_refused():
    with pytest.raises(UnknownName, match="unknown backend 'gpu'"):
        run_batch(LOOP, varied(), request(LOOP, 10, backend="gpu"))


def test_metrics_alone_or_channels_alone_can_be_asked_for():
    both = run_batch(LOOP, varied(), request(LOOP, 50, channels=RECORDED))
    only = run_batch(LOOP, varied(), Request(50, 1.0, (), ("q",), 1, "c"))
    assert only.metrics == {} and np.allclose(only.samples, recorded(both, "q"), rtol=ROUNDING)
    bare = run_batch(LOOP, varied(), request(LOOP, 50))
    assert bare.samples.shape == (COUNT, 50, 0) and bare.metrics.keys() == both.metrics.keys()
    for name, values in bare.metrics.items():
        assert np.allclose(values, both.metrics[name], rtol=ROUNDING, atol=1e-12), name


def test_programs_are_made_once_for_loops_that_differ_in_numbers():
    asked = request(LOOP, 10, channels=RECORDED)
    run_batch(LOOP, varied(), asked)
    before = len(batch._made)
    run_batch(LOOP, with_parameters(varied(), plant__body__m=np.ones(COUNT)), asked)
    assert len(batch._made) == before


def test_in_the_virtual_machine_threads_do_not_get_into_each_others_way():
    runs = one(varied(), [0, 1] * 4)
    asked = {"backend": "vm", "channels": RECORDED}
    alone = run_batch(LOOP, runs, request(LOOP, 300, **asked))
    for _ in range(5):
        assert same(alone, run_batch(LOOP, runs, request(LOOP, 300, threads=4, **asked)))


def test_single_runs_in_threads_do_not_get_into_each_others_way_either():
    def peak(seed: int) -> float:
        made = run(LOOP, begin(LOOP), 300 * LOOP.dt, seed=seed % 2, backend="vm")
        return float(made["F_m"].max())

    alone = [peak(0), peak(1)]
    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(peak, range(40))) == alone * 20
