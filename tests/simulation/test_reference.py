"""The reference integrates the continuous loop to its tolerance, and sampled runs tend to it."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any, ClassVar

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import cumulative_simpson, solve_ivp

import alight
from alight.control import ExactModel, Law, Measurement, PlainLaw, Tick
from alight.errors import AlightError
from alight.models import KelvinVoigt, PlantState, TipFriction
from alight.simulation import closed_loop
from alight.simulation.closed_loop import ClosedLoop, InitialState, advance
from alight.simulation.continuous import continuous_rates, join_state, split_state
from alight.simulation.recording import Recording
from alight.simulation.reference import Reference
from alight.simulation.run import run
from alight.simulation.verdict import Outcome
from alight.symbolic.build import build
from alight.symbolic.parameters import parameters
from alight.symbolic.signals import Signal
from alight.testbed import Encoder, Motors, Testbed
from tests.control.cases import EXPERIMENT_1, PLANT, STABLE, TARGET, changed, told

IDEAL = Testbed(encoder=Encoder(counts=0.0), motors=Motors(limit=(1e9, 1e9)))
"""No quantisation, no noise, motors that never clip."""
BOUNCING = 0.5
"""Length [s] of a run that begins 10 mm before the body and switches several times."""


def start_at(gap: float, **velocities: Any) -> InitialState:
    q = PLANT.arm.inverse((PLANT.body.x_0 + gap, 0.4), "-")
    return InitialState(q=(float(q[0]), float(q[1])), x_m=PLANT.body.x_0, **velocities)


def loop_with(law: Law | None = None, plant: alight.Plant = PLANT, **testbed: Any) -> ClosedLoop:
    return ClosedLoop(plant, dataclasses.replace(IDEAL, **testbed), law or told(plant))


def bounced(times: Any = None, **options: Any) -> Reference:
    given = np.linspace(0.0, BOUNCING, 51) if times is None else times
    return alight.reference(loop_with(), start_at(-0.01), given, **options)


def columns(recording: Recording) -> dict[str, np.ndarray]:
    return {name: recording[name] for name in recording.columns}


def assert_close(first: Recording, second: Recording, rounding: float) -> None:
    """Every signal but the bristle, which relaxes in 1 ms and steers nothing without friction."""
    for name, value in columns(second).items():
        if name not in ("z", "Lambda"):
            bound = rounding * np.abs(value).max()
            np.testing.assert_allclose(first[name], value, rtol=0, atol=bound, err_msg=name)


# Switches


def test_contact_begins_and_ends_where_the_gap_vanishes():
    switches = bounced().switches
    assert len(switches) >= 4
    at_switches = bounced(np.append(switches, BOUNCING))
    np.testing.assert_array_equal(at_switches.switches, switches)
    assert np.abs(at_switches.recording["gap"][:-1]).max() < 1e-12  # [m]


def test_between_two_switches_the_phase_stays_and_they_alternate():
    switches = bounced().switches
    borders = np.array([0.0, *switches, BOUNCING])
    middles = borders[:-1] + np.outer([0.1, 0.5, 0.9], np.diff(borders))
    gap = bounced(np.sort(middles.ravel())).recording["gap"].reshape(-1, 3)
    phases = np.sign(gap)
    assert (phases == phases[:, :1]).all()
    np.testing.assert_array_equal(phases[:, 0], -((-1.0) ** np.arange(len(phases))))


def test_a_run_that_starts_in_contact_first_switches_to_free_motion():
    gone = alight.reference(
        loop_with(), start_at(0.002, q_dot=(1.0, 1.0)), np.linspace(0.0, 0.05, 26)
    )
    assert gone.recording["gap"][0] > 0 > gone.recording["gap"][-1]
    assert len(gone.switches) == 1


def test_a_damped_contact_ceases_to_press_before_the_gap_opens():
    """Where spring and damper together begin to pull; it begins where the gap vanishes."""
    contact = KelvinVoigt(K_I=2e4, damping=50.0)
    loop, end = loop_with(plant=dataclasses.replace(PLANT, contact=contact)), 0.2
    switches = alight.reference(loop, start_at(-0.01), [end]).switches
    assert len(switches) >= 2
    r = alight.reference(loop, start_at(-0.01), np.append(switches, end)).recording
    gap, gap_dot = r["gap"][:-1], (r["x_r_dot"][:, 0] - r["x_m_dot"])[:-1]
    assert np.abs(gap[::2]).max() < 1e-12  # [m]
    assert gap[1::2].min() > 1e-6
    assert np.abs(contact.K_I * gap + contact.damping * gap_dot)[1::2].max() < 1e-6  # [N]


def test_free_motion_switches_nothing():
    assert bounced(np.linspace(0.0, 0.08, 9)).switches.size == 0


# Consistency


def test_it_integrates_what_continuous_rates_states():
    """Central differences of a dense recording are the rates at its states."""
    h = 1e-5
    times = np.array([0.05, 0.11, 0.3])
    recording = bounced(np.sort(np.concatenate([times - h, times, times + h]))).recording
    parts = ("q", "q_dot", "x_m", "x_m_dot", "z", "u_f", "theta_dk_hat", "theta_r_hat")
    states = np.hstack([recording[name].reshape(len(recording), -1) for name in parts])
    law = told()
    column = ca.SX.sym("x", states.shape[1])
    rates = build("rates", {"x": column}, {"x_dot": continuous_rates(PLANT, law, column)[0]})
    found = (states[2::3] - states[::3]) / (2 * h)
    expected = np.array([rates(x).full()[:, 0] for x in states[1::3]])
    bristle = parts.index("z") + 2
    for i in set(range(states.shape[1])) - {bristle}:
        scale = np.abs(expected[:, i]).max()
        np.testing.assert_allclose(found[:, i], expected[:, i], rtol=0, atol=1e-4 * scale + 1e-9)


def test_states_split_and_join_again():
    law = told()
    column = np.arange(1.0, 20.0)
    np.testing.assert_array_equal(join_state(law, *split_state(law, column)), column)


def test_what_is_recorded_is_consistent():
    r = bounced().recording
    np.testing.assert_allclose(r["e_r"], r["x_rd"] - r["x_r"], atol=1e-15)
    np.testing.assert_allclose(r["gap"], r["x_r1"] - r["x_m"], atol=1e-15)
    np.testing.assert_allclose(r["e_m"], TARGET.x_md - r["x_m"], atol=1e-15)
    np.testing.assert_array_equal(r["F_m"], PLANT.contact.K_I * np.maximum(r["gap"], 0.0))
    np.testing.assert_array_equal(r["Lambda"], r["gap"] >= 0)
    np.testing.assert_array_equal(r["tau_applied"], r["tau"])
    det_J = np.linalg.det([PLANT.arm.J(q) for q in r["q"]])
    np.testing.assert_allclose(r["det_J"], det_J, rtol=1e-13)


def test_the_motors_do_all_the_work_that_the_energy_shows():
    """The plant is lossless: E(t) - E(0) is the integral of tau^T q_dot, bounces included."""
    times = np.linspace(0.0, BOUNCING, 5001)
    r = bounced(times, rtol=1e-10).recording
    states = zip(r["q"], r["q_dot"], r["x_m"], r["x_m_dot"], r["z"], strict=True)
    energy = np.array([PLANT.energy(PlantState(*s)) for s in states])
    power = (r["tau"] * r["q_dot"]).sum(axis=1)
    work = cumulative_simpson(power, x=times, initial=0.0)
    # Simpson's rule loses its order at the switches
    np.testing.assert_allclose(energy - energy[0], work, rtol=0, atol=2e-5 * energy.max())


def test_the_motors_clip_in_the_reference_too():
    weak = Motors(limit=(30.0, 2.0))
    loop = loop_with(motors=weak)
    r = alight.reference(loop, start_at(-0.01), np.linspace(0.0, 0.2, 41)).recording
    np.testing.assert_array_equal(r["tau_applied"], weak.clip(r["tau"]))
    assert (np.abs(r["tau"]) > [30.0, 2.0]).any()


# Independence from solver, tolerance and samples


@pytest.mark.parametrize(("method", "rtol"), [("Radau", 1e-7), ("LSODA", 1e-10), ("RK45", 1e-9)])
def test_another_solver_finds_the_same_run(method, rtol):
    one, other = bounced(), bounced(method=method, rtol=rtol)
    assert len(one.switches) == len(other.switches)
    np.testing.assert_allclose(one.switches, other.switches, rtol=0, atol=1e-7)
    assert_close(other.recording, one.recording, 2e-5)


def test_a_tighter_tolerance_comes_closer():
    best = bounced(rtol=1e-12, atol=1e-14).recording
    errors = [
        np.abs(bounced(rtol=rtol, atol=1e-2 * rtol).recording["x_m"] - best["x_m"]).max()
        for rtol in (1e-4, 1e-6, 1e-8)
    ]
    assert errors[0] > 10 * errors[1] > 100 * errors[2]
    assert errors[2] < 1e-8


def test_the_sample_times_do_not_change_the_run():
    few = bounced(np.array([0.1, 0.25, BOUNCING]))
    many = bounced(np.linspace(0.0, BOUNCING, 501))
    np.testing.assert_array_equal(few.switches, many.switches)
    for i, time in enumerate(few.recording.t):
        j = int(np.argmin(np.abs(many.recording.t - time)))
        np.testing.assert_allclose(
            few.recording.samples[i], many.recording.samples[j], rtol=1e-9, atol=1e-9
        )


@pytest.mark.parametrize(
    "plant",
    [
        dataclasses.replace(PLANT, contact=KelvinVoigt(K_I=2e4, damping=50.0)),
        dataclasses.replace(PLANT, tip_friction=TipFriction(mu=0.3)),
    ],
    ids=["contact damping", "tip friction"],
)
def test_rates_that_jump_at_a_switch_are_integrated_by_every_solver(plant):
    """First touch makes the damper's force jump, and the bristle begins to follow the tip."""
    times = np.linspace(0.0, 0.2, 21)
    one, other = (
        alight.reference(loop_with(plant=plant), start_at(-0.01), times, method=method)
        for method in ("DOP853", "LSODA")
    )
    assert one.recording.verdict.completed and other.recording.verdict.completed
    assert len(one.switches) == len(other.switches) > 0
    assert_close(other.recording, one.recording, 1e-5)


def test_exact_model_runs_as_a_reference():
    law = ExactModel(model=PLANT, target=TARGET, gains=STABLE)
    times = np.linspace(0.0, 0.05, 6)
    r = alight.reference(loop_with(law), start_at(-0.01), times).recording
    assert r.verdict.completed and len(r) == 6
    assert "theta_r_hat" not in r


# Ends


def escaping(times: Any) -> Recording:
    """Without adaptation, which grows stiff as the filter escapes; the motors clip what it asks."""
    gains = dataclasses.replace(EXPERIMENT_1, alpha1=1e3)
    law = ExactModel(model=PLANT, target=TARGET, gains=gains)
    return alight.reference(loop_with(law, motors=Motors()), start_at(-0.05), times).recording


def test_a_filter_that_escapes_ends_the_run_at_the_instant():
    r = escaping(np.linspace(0.0, 0.1, 20001))
    assert r.verdict.outcome is Outcome.TRIPPED and not r.verdict.completed
    assert r.verdict.signal == "u_f" and "e_f escaped" in str(r.verdict)
    assert 0 <= r.verdict.time - r.t[-1] <= 5e-6
    assert np.isfinite(r.samples).all()
    assert 0.99 < np.abs(r["u_f"]).max() < 1


def test_a_run_that_trips_before_its_first_sample_records_nothing():
    r = escaping([0.1])
    assert r.verdict.outcome is Outcome.TRIPPED
    assert len(r) == 0 and r.samples.shape[1] == len(r.columns)


@parameters
class Braking(Law):
    """Stated for samples only."""

    states: ClassVar[Mapping[str, Signal]] = {}

    def initial_state(self) -> dict[str, Any]:
        return {}

    def tick(self, state: Mapping[str, Any], measured: Measurement, dt: Any) -> Tick:
        return Tick(-5.0 * measured.q_dot, {}, {})


class PlainBraking(PlainLaw):
    """The same in ordinary Python."""

    states: ClassVar[Mapping[str, Signal]] = {}

    def initial_state(self) -> dict[str, Any]:
        return {}

    def tick(self, state: Mapping[str, Any], measured: Measurement, dt: Any) -> Tick:
        return Tick(-5.0 * np.asarray(measured.q_dot), {}, {})


@pytest.mark.parametrize("law", [Braking(), PlainBraking()], ids=["Law", "PlainLaw"])
def test_a_law_that_is_stated_for_samples_only_is_refused(law):
    with pytest.raises(AlightError, match=r"Braking is a sampled law; .* continuous time"):
        alight.reference(loop_with(law), start_at(-0.01), np.linspace(0.0, 0.1, 3))


@pytest.mark.parametrize(
    "times",
    [[], [0.0], [0.1, 0.05], [0.1, 0.1], [-0.1, 0.1], [0.0, np.nan], [0.0, np.inf], [[0.0, 0.1]]],
    ids=str,
)
def test_times_that_are_not_increasing_from_zero_on_are_refused(times):
    with pytest.raises(AlightError, match="times must"):
        bounced(times)


# What a sampled run converges to


def test_a_sampled_run_tends_to_the_reference_with_order_1_in_the_sample_time():
    """Ideal sensors, before contact: hold and backward difference are first order in dt."""
    end, start = 0.08, start_at(-0.05)
    exact = alight.reference(loop_with(), start, np.linspace(0.0, end, 5), rtol=1e-12, atol=1e-14)
    assert exact.switches.size == 0
    errors: dict[str, list[float]] = {name: [] for name in ("q", "q_dot", "u_f", "theta_r_hat")}
    for rate in (2000, 4000, 8000, 16000):
        loop = loop_with(sample_rate=float(rate))
        sampled = run(loop, start, end + 1 / rate, backend="vm")
        rows = np.round(exact.recording.t * rate).astype(int)
        for name, found in errors.items():
            found.append(np.abs(sampled[name][rows] - exact.recording[name]).max())
    for name, found in errors.items():
        orders = np.log2(np.divide(found[:-1], found[1:]))
        np.testing.assert_allclose(orders, 1.0, atol=0.05, err_msg=name)


def test_quantised_sensors_keep_it_away_from_the_reference():
    """The same comparison with resolvers: the gap no longer closes with the sample time."""
    end, start = 0.08, start_at(-0.05)
    exact = alight.reference(loop_with(), start, [end]).recording["q_dot"][0]
    errors = []
    for rate in (4000, 32000):
        loop = loop_with(sample_rate=float(rate), encoder=Encoder(counts=8192.0))
        sampled = run(loop, start, end + 1 / rate, backend="vm")
        errors.append(np.abs(sampled["q_dot"][round(end * rate)] - exact).max())
    assert errors[1] > errors[0] / 4


@pytest.mark.parametrize(
    ("gap", "compression"), [(-0.05, 0.0), (0.01, 0.02)], ids=["free motion", "contact"]
)
def test_the_plant_over_a_sample_converges_with_order_5_to_a_tight_solver(gap, compression):
    """Under one held torque, away from the kink of (7)."""
    slow = dataclasses.replace(IDEAL, sample_rate=100.0)
    x_m = PLANT.body.x_0 + compression
    q = PLANT.arm.inverse((x_m + gap, 0.4), "-")
    s = PlantState(q, np.array([-0.5, 1.0]), x_m, 0.1, 0.0)
    tau = np.array([5.0, -2.0])
    x = ca.SX.sym("x", closed_loop.PLANT.size)
    moving = PLANT.rates(PlantState(**closed_loop.PLANT.unpack(x)), tau)
    rates = build("rates", {"x": x}, {"x_dot": closed_loop.PLANT.pack(moving._asdict())})
    exact = solve_ivp(
        lambda t, x: rates(x).full()[:, 0],
        (0.0, 1 / slow.sample_rate),
        closed_loop.PLANT.pack(s._asdict()),
        method="DOP853",
        rtol=1e-13,
        atol=1e-15,
    ).y[:7, -1]
    errors = []
    for substeps in (1, 2, 4, 8, 16):
        after = advance(ClosedLoop(PLANT, slow, Braking(), substeps), s, tau)
        assert (PLANT.touch(after).gap > 0) == (gap > 0)
        errors.append(np.abs(closed_loop.PLANT.pack(after._asdict())[:7] - exact).max())
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert orders[-1] == pytest.approx(5.0, abs=0.3)
    assert (orders > 3.0).all(), orders


def test_a_change_of_gains_changes_the_reference():
    """The numbers of the law are not those of another loop with the same structure."""
    times = np.array([0.05])
    one, other = (
        alight.reference(loop_with(law), start_at(-0.05), times).recording["q"]
        for law in (told(), changed(told(), alpha1=20.0))
    )
    assert np.abs(one - other).max() > 1e-6
