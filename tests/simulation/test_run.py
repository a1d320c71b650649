"""One run: its samples, its channels, its seeds, and the verdict that ends it."""

from __future__ import annotations

import dataclasses
import importlib
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import alight
from alight.control import Law, Measurement, PlainLaw, Tick
from alight.errors import AlightError, UnknownName
from alight.models import PlantState
from alight.simulation.closed_loop import ClosedLoop, advance
from alight.simulation.recording import Recording
from alight.simulation.run import run, select
from alight.simulation.verdict import Outcome
from alight.symbolic.signals import Signal
from alight.testbed import Encoder, Motors, Testbed
from tests.control.cases import EXPERIMENT_1, PLANT, STABLE, changed, told
from tests.kernels.programs import NOISY, TRIP, Counting, start

run_module = importlib.import_module("alight.simulation.run")


class PlainCounting(PlainLaw):
    """`Counting` as a law in ordinary Python."""

    states: ClassVar[Mapping[str, Signal]] = Counting.states
    signals: ClassVar[Mapping[str, Signal]] = Counting.signals
    trips: ClassVar[Mapping[int, str]] = Counting.trips

    def __init__(self, **settings: float) -> None:
        self.inner = Counting(**settings)

    def initial_state(self) -> Mapping[str, Any]:
        return self.inner.initial_state()

    def tick(self, state: Mapping[str, Any], measured: Measurement, dt: Any) -> Tick:
        with np.errstate(invalid="ignore"):
            return self.inner.tick(state, measured, dt)


EITHER = pytest.mark.parametrize("cls", [Counting, PlainCounting])


def ran(law: Law, duration: float = 0.1, testbed: Testbed = NOISY, **options: Any) -> Recording:
    options.setdefault("backend", "vm")
    return run(ClosedLoop(PLANT, testbed, law), start(), duration, **options)


# Samples


@EITHER
@settings(max_examples=10)
@given(st.integers(1, 400), st.sampled_from([500.0, 2000.0, 10000.0]))
def test_a_run_has_one_sample_for_each_sample_time(cls, ticks, rate):
    r = ran(cls(), ticks / rate, dataclasses.replace(NOISY, sample_rate=rate))
    assert len(r) == ticks and r.verdict.outcome is Outcome.COMPLETED
    np.testing.assert_allclose(r.t, np.arange(ticks) / rate, rtol=1e-12)
    assert r.verdict.time == r.t[-1]


@EITHER
def test_the_first_sample_is_the_start(cls):
    r, s = ran(cls()), start()
    for name, value in (("q", s.q), ("q_dot", s.q_dot), ("x_m", s.x_m), ("x_m_dot", s.x_m_dot)):
        np.testing.assert_array_equal(r[name][0], value)
    np.testing.assert_array_equal(r["count"], np.arange(len(r)))


def test_each_sample_follows_from_the_one_before_by_the_plant_over_a_sample():
    loop = ClosedLoop(PLANT, NOISY, told())
    r = run(loop, start(), 0.02, backend="vm")
    parts = ("q", "q_dot", "x_m", "x_m_dot", "z")
    for i in (0, 7, 20, 38):
        s = PlantState(*(r[name][i] for name in parts))
        following = advance(loop, s, r["tau_applied"][i])
        for name, value in zip(parts, following, strict=True):
            np.testing.assert_allclose(r[name][i + 1], value, rtol=1e-10, atol=1e-14)


def test_each_state_of_the_law_follows_from_what_it_measured():
    law = told()
    r = ran(law, 0.02)
    for i in (0, 7, 20, 38):
        seen = Measurement(*(r[f"{name}_measured"][i] for name in Measurement._fields))
        tick = law.tick({name: r[name][i] for name in law.states}, seen, 5e-4)
        np.testing.assert_allclose(r["tau"][i], tick.tau, rtol=1e-9)
        for name, value in tick.state.items():
            np.testing.assert_allclose(r[name][i + 1], value, rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize("block", [1, 7, 2048])
@EITHER
def test_a_run_does_not_depend_on_its_blocks(cls, block, monkeypatch):
    whole = ran(cls())
    monkeypatch.setattr(run_module, "BLOCK", block)
    np.testing.assert_array_equal(ran(cls()).samples, whole.samples)


def test_two_loops_of_one_structure_keep_their_own_numbers():
    """They share a program; their parameters are its inputs."""
    laws = [told(), changed(told(), alpha1=20.0), told()]
    first, other, again = (ran(law, 0.02).samples for law in laws)
    np.testing.assert_array_equal(first, again)
    assert (first != other).any()


def test_two_laws_of_one_name_keep_their_own_equations():
    def law(factor: float) -> Law:
        class Same(Counting):
            def tick(self, state: Mapping[str, Any], measured: Measurement, dt: Any) -> Tick:
                return super().tick(state, measured, dt)._replace(tau=factor * measured.q_dot)

        return Same()

    pull, push = (ran(law(factor), 0.02) for factor in (-1.0, 1.0))
    np.testing.assert_array_equal(pull["tau"][0], -push["tau"][0])


# Channels


@EITHER
@pytest.mark.parametrize("channels", [("tau",), ("root", "q", "gap"), ("count", "Lambda")])
def test_channels_choose_columns_and_change_nothing(cls, channels):
    whole, part = ran(cls()), ran(cls(), channels=channels)
    assert set(part.layout.signals) == set(channels)
    for name in channels:
        np.testing.assert_array_equal(part[name], whole[name])
    assert part.verdict == whole.verdict
    np.testing.assert_array_equal(select(whole, channels).samples, part.samples)


@pytest.mark.parametrize(
    "cls",
    [
        Counting,
        PlainCounting,
    ],
)
def test_an_unknown_channel_is_refused_with_the_known_ones(cls):
    with pytest.raises(UnknownName, match=r"signal 'speed'.*x_m_dot"):
        ran(cls(), channels=("q", "speed"))


# Seeds


@EITHER
def test_the_seed_decides_the_noise_and_nothing_else_does(cls):
    one, same, other = (ran(cls(), seed=seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(one.samples, same.samples)
    assert (one["x_m_measured"] != other["x_m_measured"]).any()
    quiet = [ran(cls(), testbed=Testbed(), seed=seed).samples for seed in (1, 2)]
    np.testing.assert_array_equal(*quiet)


@EITHER
def test_a_longer_run_begins_as_a_shorter_one(cls):
    long, short = ran(cls(), 0.3), ran(cls(), 0.1)
    np.testing.assert_array_equal(long.samples[: len(short)], short.samples)


# Progress


@EITHER
def test_progress_rises_to_one(cls, monkeypatch):
    monkeypatch.setattr(run_module, "BLOCK", 30)
    shares: list[float] = []
    ran(cls(), progress=shares.append)
    assert shares == [0.15, 0.3, 0.45, 0.6, 0.75, 0.9, 1.0]


# Verdicts


@EITHER
@pytest.mark.parametrize("last", [0, 1, 99, 255, 256, 300])
def test_a_trip_ends_the_run_and_keeps_the_rows_up_to_it(cls, last):
    r, whole = ran(cls(trip_at=float(last)), 0.2), ran(cls(), 0.2)
    assert r.verdict.outcome is Outcome.TRIPPED and not r.verdict.completed
    assert r.verdict.cause == Counting.trips[TRIP]
    assert r.verdict.time == r.t[-1] == pytest.approx(last / 2000)
    np.testing.assert_array_equal(r.samples, whole.samples[: last + 1])


@EITHER
def test_a_signal_that_is_no_number_is_named(cls):
    r = ran(cls(real_until=49.5), 0.2)
    assert r.verdict.outcome is Outcome.NOT_FINITE
    assert r.verdict.signal == "root"
    assert len(r) == 51 and np.isnan(r["root"][-1]) and np.isfinite(r.samples[:-1]).all()


def test_a_filter_that_escapes_trips_the_law():
    law = told(gains=dataclasses.replace(EXPERIMENT_1, alpha1=5e3))
    r = ran(law, 1.0)
    assert r.verdict.outcome is Outcome.TRIPPED
    assert r.verdict.signal == "u_f" and "e_f escaped" in str(r.verdict)
    assert np.abs(r["u_f"]).max() < 1
    assert len(r) < 2000


class Pushing(Counting):
    """Pushes the joints along with their motion."""

    push: ClassVar[float] = 1e3

    def tick(self, state: Mapping[str, Any], measured: Measurement, dt: Any) -> Tick:
        return super().tick(state, measured, dt)._replace(tau=self.push * measured.q_dot)


class PushingHard(Pushing):
    """The plant overflows between two samples."""

    push = 1e4


UNLIMITED = Testbed(encoder=Encoder(counts=0.0), motors=Motors(limit=(1e12, 1e12)))


def test_a_plant_that_flies_apart_is_called_diverged():
    r = run(ClosedLoop(PLANT, UNLIMITED, Pushing(), substeps=1), start(), 1.0, backend="vm")
    assert r.verdict.outcome is Outcome.DIVERGED
    assert r.verdict.signal in {"q_dot1", "q_dot2"}
    assert r.verdict.time == r.t[-1] < 0.1
    assert np.isfinite(r.samples).all()


def test_a_plant_that_overflows_is_not_put_down_to_the_law():
    r = ran(PushingHard(), 1.0, UNLIMITED)
    assert r.verdict.outcome is Outcome.DIVERGED
    assert r.verdict.signal in {"q1", "q2", "q_dot1", "q_dot2", "x_m", "x_m_dot"}


def test_what_a_verdict_says_can_be_read_by_a_person():
    completed, tripped = ran(Counting()), ran(Counting(trip_at=30.0))
    assert str(completed.verdict) == f"ran to its end at {completed.t[-1]:.4g} s"
    assert "it has counted far enough" in str(tripped.verdict)
    assert f"{tripped.t[-1]:.4g} s" in str(tripped.verdict)


# The loop as a whole


def test_the_stable_gains_bring_the_mass_to_the_set_point_where_the_printed_ones_do_not():
    """LOC in the sampled loop, on the lossless plant with true parameters and ideal sensors."""
    fine = Testbed(sample_rate=8000.0, encoder=Encoder(counts=0.0))
    final = {}
    for gains in (STABLE, EXPERIMENT_1):
        law = told(gains=gains)
        truth = tuple(np.array(law.theta_r.initial) / 0.7)
        law = dataclasses.replace(
            law,
            theta_r=dataclasses.replace(law.theta_r, initial=truth),
            theta_dk=dataclasses.replace(law.theta_dk, initial=PLANT.theta_dk),
        )
        r = ran(law, 3.0, fine, channels=("e_m",))
        final[gains.alpha1] = np.abs(r.last(0.2)["e_m"]).max() if r.verdict.completed else np.inf
    assert final[10.0] < 1e-3 < final[55.0]


@pytest.mark.parametrize("duration", [1e12])
def test_a_recording_that_no_machine_holds_is_refused(duration):
    with pytest.raises(AlightError, match="shorter duration"):
        ran(Counting(), duration)


@pytest.mark.parametrize("every", [1, 7, 2048, 5000])
def test_a_thinned_recording_is_every_so_many_samples_of_the_whole(every):
    scenario = alight.load_scenario("experiment-1", {"duration": 1.2, "steady_state": 0.1})
    whole = alight.simulate(scenario, channels=("q", "F_m"))
    thin = alight.simulate(scenario, channels=("q", "F_m"), every=every)
    np.testing.assert_array_equal(thin.t, whole.t[::every])
    np.testing.assert_array_equal(thin.samples, whole.samples[::every])
    assert thin.verdict == whole.verdict


def test_a_thinned_recording_keeps_the_sample_at_which_a_run_ended():
    scenario = alight.load_scenario("experiment-1", {"plant.body.m": 1e-9})
    whole, thin = alight.simulate(scenario), alight.simulate(scenario, every=1000)
    assert not whole.verdict.completed and thin.verdict == whole.verdict
    assert thin.t[-1] == whole.t[-1]
    np.testing.assert_array_equal(thin.samples[-1], whole.samples[-1])


def test_every_below_one_is_refused():
    with pytest.raises(alight.AlightError, match="every = 0: must be 1 or more"):
        alight.simulate("experiment-1", every=0)
