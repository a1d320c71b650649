"""Metrics gathered tick by tick are those of whole recordings."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import alight
from alight.errors import UnknownName
from alight.scenarios import load_scenario
from alight.simulation.metrics import METRICS, Gathering, Length, Moment, chosen, steady_first
from alight.studies import measure
from alight.symbolic.signals import Layout
from tests.simulation.figures import expected

SIGNALS = load_scenario("experiment-1").closed_loop.signals
EVERY = Gathering(chosen(None, SIGNALS))
LAYOUT = Layout({name: SIGNALS[name] for name in EVERY.needs})
FOLD = EVERY.fold(LAYOUT)
DT = 5e-4


def signals_of(seed: int, ticks: int, scale: float = 1.0) -> dict[str, np.ndarray]:
    """Signals at random: forces that come and go, errors that decay, torques that clip."""
    rng = np.random.default_rng(seed)
    made = {
        name: np.squeeze(scale * rng.standard_normal((ticks, signal.size)), axis=1)
        if signal.size == 1
        else scale * rng.standard_normal((ticks, signal.size))
        for name, signal in LAYOUT.signals.items()
    }
    made["F_m"] = np.maximum(made["F_m"] + scale * rng.uniform(-1, 1), 0.0)
    made["e_m"] *= np.exp(-np.arange(ticks) / rng.uniform(1, ticks + 1))
    made["clipped"] = (made["clipped"] > 0).astype(float)
    return made


def rows_of(signals: dict[str, np.ndarray]) -> np.ndarray:
    columns = [signals[name].reshape(-1, s.size) for name, s in LAYOUT.signals.items()]
    return np.hstack(columns)


def gathered(
    signals: dict[str, np.ndarray], first: int, travel: float, ticks: int | None = None
) -> dict[str, np.ndarray]:
    memory, y = EVERY.start, rows_of(signals)
    for k in range(len(y)):
        memory = np.asarray(FOLD(memory, y[k], k, [first, travel])).ravel()
    length = Length(DT, np.array([len(y)]), np.array([max(len(y) - first, 0)]))
    results = EVERY.results(memory[:, None], length)
    return {name: values[0] for name, values in results.items()}


@given(
    seed=st.integers(0, 10**6),
    ticks=st.integers(0, 40),
    late=st.integers(0, 45),
    travel=st.floats(0.01, 10),
    scale=st.sampled_from([1e-6, 1.0, 1e4]),
)
def test_every_metric_is_what_numpy_makes_of_the_recording(seed, ticks, late, travel, scale):
    signals = signals_of(seed, ticks, scale)
    told = expected(signals, dt=DT, first=late, travel=travel)
    found = gathered(signals, late, travel)
    assert found.keys() == told.keys() == METRICS.keys()
    for name, value in told.items():
        # A spread is a difference of sums of squares: half the digits are left.
        tolerance = 1e-6 if name == "chatter" else 1e-12
        close = np.allclose(found[name], value, rtol=tolerance, atol=tolerance, equal_nan=True)
        assert close, (name, found[name], value)


def test_what_was_never_in_steady_state_has_no_steady_state_values():
    found = gathered(signals_of(0, 10), 20, 0.03)
    late = ("chatter", "steady_e_m", "steady_e_r", "mean_e_m", "mean_e_r")
    for name, values in found.items():
        assert np.isnan(values).all() == (name in late)


def test_a_run_of_no_tick_has_no_clearance_and_no_force():
    found = gathered(signals_of(0, 0), 0, 0.03)
    assert np.isnan(found["least_clearance"]) and found["peak_F_m"] == 0


@given(st.lists(st.sampled_from([0.0, 2.0]), max_size=30))
def test_separations_are_counted_at_the_end_of_each_contact(forces):
    signals = signals_of(0, len(forces))
    signals["F_m"] = np.array(forces, dtype=float)
    ends = sum(a > 0 and b == 0 for a, b in itertools.pairwise(forces))
    assert gathered(signals, 0, 1.0)["separations"] == ends


@given(st.lists(st.floats(0, 100), min_size=1, max_size=30), st.data())
def test_a_value_that_is_no_number_does_not_hide_a_peak(forces, data):
    holes = data.draw(st.lists(st.booleans(), min_size=len(forces), max_size=len(forces)))
    signals = signals_of(0, len(forces))
    signals["F_m"] = np.where(holes, np.nan, forces)
    known = [f for f, hole in zip(forces, holes, strict=True) if not hole]
    assert gathered(signals, 0, 1.0)["peak_F_m"] == max(known, default=0.0)


@given(st.integers(1, 5000), st.sampled_from([5e-4, 1e-3, 1 / 3000]), st.floats(1e-6, 4.0))
def test_the_steady_state_part_is_the_last_seconds(ticks, dt, length):
    t = np.arange(ticks) * dt
    first = steady_first(ticks, dt, length)
    assert np.array_equal(np.flatnonzero(t > t[-1] - length), np.arange(first, ticks))


def test_the_length_of_a_run_costs_no_memory_to_find_its_steady_state():
    assert steady_first(10**12, 5e-4, 2.0) == 10**12 - 4000


def test_metrics_are_chosen_by_name_and_by_what_the_law_says():
    assert [m.name for m in chosen(None, SIGNALS)] == list(METRICS)
    assert [m.name for m in chosen(("impulse", "chatter"), SIGNALS)] == ["impulse", "chatter"]
    bare = {name: signal for name, signal in SIGNALS.items() if name not in ("e_m", "e_r")}
    assert "settling" not in {m.name for m in chosen(None, bare)}
    with pytest.raises(UnknownName, match=r"unknown metric 'peek'; one of: chatter, .*peak_F_m"):
        chosen(("peek",), SIGNALS)
    with pytest.raises(UnknownName, match=r"unknown signal of the metric 'settling' 'e_m'"):
        chosen(("settling",), bare)


@pytest.mark.parametrize("name", METRICS)
def test_each_metric_says_what_it_needs_and_how_many_entries_it_has(name):
    metric = METRICS[name]
    layout = Layout({n: SIGNALS[n] for n in metric.needs})
    signals = layout.unpack(np.zeros(layout.size))
    memory = metric.fold(metric.start, signals, Moment(0.0, 1.0, 1.0))
    assert len(memory) == len(metric.start)
    columns = [np.array([float(np.squeeze(v))]) for v in memory]
    assert len(metric.result(columns, Length(DT, np.ones(1), np.ones(1)))) == metric.signal.size


def test_a_recording_with_ticks_left_out_has_no_metrics():
    scenario = alight.load_scenario("experiment-1", {"duration": 0.1, "steady_state": 0.05})
    thin = alight.simulate(scenario, every=2)
    with pytest.raises(alight.AlightError, match="every tick"):
        measure(thin, scenario)
