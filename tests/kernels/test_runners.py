"""What every runner does: the same bits, in any blocks, up to exactly where a run ends."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from alight.errors import UnknownName
from alight.kernels import BACKENDS, Runner, runner
from alight.kernels.program import stop_index
from alight.kernels.vm import LONG as BLOCK
from tests.compiler import NEEDS_COMPILER, has_compiler
from tests.kernels.programs import TRIP, Prepared, counting, loops, noise_of, prepared

EACH_BACKEND = pytest.mark.parametrize(
    "backend", ["vm", "auto", pytest.param("c", marks=NEEDS_COMPILER)]
)
LENGTHS = [1, 2, BLOCK - 1, BLOCK, BLOCK + 1, 2 * BLOCK, 2 * BLOCK + 17]


@functools.cache
def made(backend: str, name: str = "counting") -> tuple[Prepared, Runner]:
    program = prepared(loops()[name])
    return program, runner(program.program, backend)  # type: ignore[arg-type]


def counted(**settings_: float) -> np.ndarray:
    """Parameters of the counting loop with other settings: the program is the same."""
    return counting(**settings_).parameter_values()


# The same bits


@NEEDS_COMPILER
@pytest.mark.parametrize("name", list(loops()))
def test_virtual_machine_and_compiled_c_agree_bit_by_bit(name):
    program, vm = made("vm", name)
    _, compiled = made("c", name)
    noise = noise_of(700)
    (x_vm, y_vm), (x_c, y_c) = (program.run(r, noise) for r in (vm, compiled))
    assert y_vm.shape == y_c.shape and len(y_vm) == 700
    assert y_vm.tobytes() == y_c.tobytes()
    assert x_vm.tobytes() == x_c.tobytes()
    contact = program.program.recorded.columns.index("Lambda")
    assert set(y_vm[:, contact]) == {0.0, 1.0}


@EACH_BACKEND
@pytest.mark.parametrize("ticks", LENGTHS)
def test_a_run_is_its_ticks_one_by_one(backend, ticks):
    program, made_runner = made(backend)
    noise = noise_of(ticks)
    x, rows, kept = program.x, [], program.program.once(program.p)
    for w in noise:
        x_next, y = program.program.tick(x, w, kept)
        x = x_next.full()[:, 0]
        rows.append(y.full()[:, 0])
    x_end, y = program.run(made_runner, noise)
    np.testing.assert_array_equal(y, rows)
    np.testing.assert_array_equal(x_end, x)


@EACH_BACKEND
@settings(max_examples=15)
@given(st.integers(1, 600), st.integers(1, 600))
def test_a_run_does_not_depend_on_the_blocks_it_is_made_in(backend, first, second):
    program, made_runner = made(backend)
    noise = noise_of(first + second)
    x_whole, y_whole = program.run(made_runner, noise)
    x, y_first = program.run(made_runner, noise[:first])
    x, y_second = made_runner.run(x, noise[first:], program.p)
    np.testing.assert_array_equal(np.concatenate([y_first, y_second]), y_whole)
    np.testing.assert_array_equal(x, x_whole)


@EACH_BACKEND
def test_a_run_leaves_its_arguments_as_they_were(backend):
    program, made_runner = made(backend)
    noise = noise_of(300)
    before = [v.copy() for v in (program.x, noise, program.p)]
    again = [program.run(made_runner, noise)[1] for _ in range(2)]
    np.testing.assert_array_equal(*again)
    for kept, now in zip(before, (program.x, noise, program.p), strict=True):
        np.testing.assert_array_equal(kept, now)


@EACH_BACKEND
def test_rows_of_one_run_are_not_overwritten_by_the_next(backend):
    program, made_runner = made(backend)
    _, first = program.run(made_runner, noise_of(50, seed=1))
    kept = first.copy()
    program.run(made_runner, noise_of(50, seed=2))
    np.testing.assert_array_equal(first, kept)


# Where a run ends


@EACH_BACKEND
@pytest.mark.parametrize("last", [0, 1, BLOCK - 1, BLOCK, BLOCK + 1, 2 * BLOCK - 1, 599])
def test_a_trip_ends_the_run_with_its_own_row(backend, last):
    program, made_runner = made(backend)
    noise = noise_of(600)
    p = counted(trip_at=float(last))
    x, y = made_runner.run(program.x, noise, p)
    assert len(y) == last + 1
    assert y[-1, -1] == TRIP and not y[:-1, -1].any()
    x_until, y_until = made_runner.run(program.x, noise[: last + 1], counted())
    np.testing.assert_array_equal(y[:, :-1], y_until[:, :-1])
    np.testing.assert_array_equal(x, x_until)


@EACH_BACKEND
@pytest.mark.parametrize("last", [0, BLOCK - 1, BLOCK, 300])
def test_a_signal_that_is_no_number_ends_the_run_with_its_own_row(backend, last):
    program, made_runner = made(backend)
    noise = noise_of(600)
    _, y = made_runner.run(program.x, noise, counted(real_until=float(last) - 0.5))
    assert len(y) == last + 1
    finite = np.isfinite(y)
    assert finite[:-1].all()
    root = program.program.recorded.columns.index("root")
    assert np.isnan(y[-1, root]) and np.delete(finite[-1], root).all()


def test_the_stop_index_is_that_of_the_first_row_that_trips_or_is_not_finite():
    rng = np.random.default_rng(0)
    for _ in range(200):
        y = rng.standard_normal((rng.integers(1, 9), 3))
        y[:, -1] = rng.random(len(y)) < 0.1
        y[rng.random(y.shape) < 0.03] = rng.choice([np.nan, np.inf, -np.inf])
        expected = len(y)
        for i, row in enumerate(y):
            if row[-1] or not np.isfinite(row).all():
                expected = i + 1
                break
        assert stop_index(y) == expected


# Which one runs


def test_each_runner_says_its_name():
    assert made("vm")[1].name == "vm"
    assert made("auto")[1].name == "auto"
    if has_compiler():
        assert made("c")[1].name == "c"


@pytest.mark.parametrize("backend", ["gpu", "", "C", None])
def test_an_unknown_backend_is_refused(backend):
    with pytest.raises(UnknownName, match="one of: auto, c, lanes, vm"):
        runner(made("vm")[0].program, backend)
    assert set(BACKENDS) == {"auto", "vm", "c", "lanes"}


@pytest.mark.parametrize("channels", [(), ("root",), ("q", "F_m", "tau")])
@EACH_BACKEND
def test_fewer_channels_are_the_same_numbers(backend, channels):
    whole, made_runner = made("vm")
    part = prepared(counting(), channels)
    noise = noise_of(300)
    _, y = part.run(runner(part.program, backend), noise)
    _, all_of_it = whole.run(made_runner, noise)
    names = part.program.recorded.columns
    assert y.shape == (300, len(names) + 1)
    for i, name in enumerate(names):
        column = whole.program.recorded.columns.index(name)
        np.testing.assert_array_equal(y[:, i], all_of_it[:, column], err_msg=name)


# The same run to rounding


@NEEDS_COMPILER
@pytest.mark.parametrize("name", list(loops()))
def test_a_single_lane_makes_the_same_run_to_rounding(name):
    program, vm = made("vm", name)
    _, lane = made("lanes", name)
    noise = noise_of(300)
    (x_vm, y_vm), (x_lane, y_lane) = (program.run(r, noise) for r in (vm, lane))
    size = 1 + np.abs(y_vm).max(axis=0)
    assert y_lane.shape == y_vm.shape and not np.isnan(y_lane).any()
    assert (np.median(np.abs(y_lane - y_vm), axis=0) <= 1e-7 * size).all()
    np.testing.assert_allclose(x_lane[:4], x_vm[:4], atol=1e-5)


@NEEDS_COMPILER
@pytest.mark.parametrize("last", [0, 1, 100, 299])
def test_a_single_lane_ends_with_the_row_of_the_trip(last):
    program, lane = made("lanes")
    _, vm = made("vm")
    p = counted(trip_at=float(last))
    (x, y), (x_vm, y_vm) = (r.run(program.x, noise_of(300), p) for r in (lane, vm))
    assert len(y) == last + 1 and y[-1, -1] == TRIP and (y[:-1, -1] == 0).all()
    np.testing.assert_allclose(y, y_vm, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(x, x_vm, rtol=1e-9, atol=1e-9)
