"""A cycle of the bench is the simulation, held in its states; whatever is asked, torque obeys."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import alight
from alight.control.transition import FILTER_TRIP
from alight.errors import AlightError
from alight.live.bank import Bank, parameter_column, with_parameters
from alight.live.cycle import DEADLINES, DEVICE_LOST, LIMIT, LONGEST_KICK, NOT_FINITE, Cycle
from alight.live.devices.simulated import SimulatedTestbed
from alight.live.shared.commands import Kind
from alight.live.shared.status import State
from alight.simulation.closed_loop import NO_TORQUE
from tests.cli.command import OWN_ARM
from tests.compiler import NEEDS_COMPILER
from tests.live.cycles import Driven, driven, scenario

NOISY = ("testbed.transducer.noise=1e-6",)


# A run is the simulation


def compared(chosen: alight.Scenario, made: Driven, backend: str = "vm") -> list[str]:
    """Signals in which a live run and the simulation of a scenario differ by a bit."""
    recorded = alight.simulate(chosen, backend=backend)  # type: ignore[arg-type]
    made.ticks(3)
    assert made.command(Kind.START) == ""
    rows = made.ticks(len(recorded))
    shared = [n for n in recorded.layout.signals if n in made.cycle.layout.signals]
    assert {"q", "x_m_dot_measured", "tau", "tau_applied", "e_r", "u_f", "F_m"} <= set(shared)
    np.testing.assert_array_equal(made.of(rows, "t"), recorded.t)
    return [n for n in shared if not np.array_equal(made.of(rows, n), recorded[n])]


@pytest.mark.parametrize(
    "of",
    [
        ("experiment-1",),
        ("experiment-2", *NOISY),
        (OWN_ARM, "testbed.delay=true", "seed=7"),
    ],
)
def test_a_run_without_commands_is_the_simulation_to_the_last_bit(of):
    assert compared(scenario(*of), driven(*of)) == []


@NEEDS_COMPILER
def test_compiled_it_is_the_same():
    chosen = scenario("experiment-1", *NOISY)
    assert compared(chosen, Driven(chosen, "c"), "c") == []


def test_every_run_after_a_reset_is_the_first_one_again():
    made, runs = driven("experiment-1", *NOISY), []
    for waiting in (0, 1, 17):
        made.ticks(waiting)
        assert made.command(Kind.START) == ""
        runs.append(made.ticks(300))
        made.command(Kind.STOP)
        made.ticks(waiting)
        assert made.command(Kind.RESET) == ""
    for run in runs[1:]:
        for name in ("t", "q", "x_m_measured", "torque", "theta_r_hat", "V_r"):
            np.testing.assert_array_equal(made.of(run, name), made.of(runs[0], name))


def test_gains_that_come_before_the_start_are_those_of_a_scenario_that_has_them():
    made = driven()
    column = made.changed(gains__alpha1=20.0, target__x_md=0.23)
    assert made.command(Kind.PARAMETERS, 0, column) == ""
    other = scenario("experiment-1", "law.gains.alpha1=20.0", "target.x_md=0.23")
    assert compared(other, made) == []


def test_a_law_that_comes_before_the_start_is_that_of_a_scenario_that_has_it():
    made = driven("experiment-1", "limits={}")
    number = made.bank.number_of["exact-model"]
    assert made.command(Kind.LAW, number, parameter_column(made.bank.loops[number])) == ""
    assert compared(scenario("experiment-1", "limits={}", "law.type=exact-model"), made) == []


def test_the_lyapunov_function_is_that_of_the_theory():
    from alight.control.adaptive import AdaptiveState
    from alight.models import PlantState
    from alight.theory.lyapunov import V_r

    made = driven()
    made.command(Kind.START)
    made.ticks(200)
    for k in (0, 150, 199):
        names = made.cycle.layout.slices()
        row = made.rows[k]
        s = PlantState(*(np.squeeze(row[names[n]]) for n in PlantState._fields))
        a = AdaptiveState(*(np.squeeze(row[names[n]]) for n in AdaptiveState._fields))
        expected = V_r(made.scenario.plant, made.scenario.law, s, a)
        assert made["V_r"][k] == pytest.approx(float(expected), rel=1e-12)


# States


def test_while_ready_plant_and_law_stand_and_no_torque_is_sent():
    made = driven("experiment-1", *NOISY)
    rows = made.ticks(50)
    start = made.scenario.start
    assert not made.of(rows, "torque").any() and not made.of(rows, "tau_applied").any()
    assert (made.of(rows, "q") == np.array(start.q)).all()
    assert (made.of(rows, "t") == 0).all() and (made.of(rows, "state") == State.READY).all()
    assert (made.of(rows, "theta_dk_hat") == made.scenario.law.theta_dk.initial).all()


def test_stopped_it_sends_nothing_and_the_plant_goes_on():
    made = driven()
    made.command(Kind.START)
    run = made.ticks(200)
    made.command(Kind.STOP)
    after = made.ticks(200)
    assert not made.of(after, "torque").any()
    assert made.of(run, "torque")[-1].any()
    moved = made.of(after, "q")
    assert (moved[0] != moved[-1]).any()
    np.testing.assert_array_equal(made["t"], np.arange(400) * made.bank.loops[0].dt)
    assert (made.of(after, "u_f") == made.of(after, "u_f")[0]).all()


def test_a_new_law_takes_over_what_the_old_one_knows():
    made = driven()
    made.command(Kind.START)
    made.ticks(300)
    number = made.bank.number_of["unsaturated"]
    made.command(Kind.LAW, number, parameter_column(made.bank.loops[number]))
    rows = made.ticks(1)
    assert made.of(rows, "law")[0] == number
    old, new = (made.bank.loops[n].law.states for n in (0, number))
    shared = [name for name in new if old.get(name) == new[name]]
    assert {"theta_r_hat", "theta_dk_hat", "u_f"} <= set(shared)
    undisturbed = driven_rows(301)[-1:]
    for name in shared:
        np.testing.assert_array_equal(made.of(rows, name), made.of(undisturbed, name))
    initial = np.array(made.scenario.law.theta_r.initial)
    assert (made.of(rows, "theta_r_hat")[0] != initial).any()


def test_a_law_leaves_no_number_in_the_columns_that_another_one_does_not_have():
    made = driven()
    assert np.isfinite(made.ticks(1)).all()
    number = made.bank.number_of["exact-model"]
    made.command(Kind.LAW, number, parameter_column(made.bank.loops[number]))
    rows = made.ticks(1)
    assert np.isnan(made.of(rows, "theta_r_hat")).all() and np.isnan(made.of(rows, "V_r")).all()
    assert np.isfinite(made.of(rows, "u_f")).all()
    made.command(Kind.LAW, 0, parameter_column(made.bank.loops[0]))
    assert np.isfinite(made.ticks(1)).all()


def test_a_kick_adds_its_torque_for_its_time_within_the_motors_limit():
    made, limit = driven(), np.array([240.0, 20.0])
    made.command(Kind.START)
    made.ticks(20)
    assert made.command(Kind.KICK, 0, [1.5, -1e9, 0.005]) == ""
    made.ticks(20)
    tau, torque, kick = (made[name] for name in ("tau", "torque", "kick"))
    pushed = np.flatnonzero(kick[:, 0])
    np.testing.assert_array_equal(pushed, np.arange(20, 30))
    within = np.clip(tau, -limit, limit)
    np.testing.assert_array_equal(torque[pushed], np.clip(within + kick, -limit, limit)[pushed])
    np.testing.assert_array_equal(torque[:20], within[:20])
    np.testing.assert_array_equal(torque[30:], within[30:])
    assert (torque[pushed, 1] == -limit[1]).all()


# Trips


def run_until_trip(made: Driven, most: int = 4000) -> None:
    assert made.command(Kind.START) == ""
    while made.cycle.state is State.RUNNING:
        made.ticks(1)
        assert len(made.kept) < most
    assert not made.of(made.ticks(20), "torque").any()
    assert (made["trip"][-20:] == made.cycle.code).all()
    assert made.cycle.state is State.TRIPPED


def test_the_law_trips_in_the_tick_in_which_its_filter_escapes():
    made = driven("experiment-1", "law.gains.alpha1=5000.0")
    run_until_trip(made)
    assert made.cycle.code == FILTER_TRIP
    assert made.cycle.reason == made.scenario.law.trips[FILTER_TRIP]
    first = np.argmax(made["state"] == State.TRIPPED)
    assert not made["torque"][first:].any() and made["torque"][first - 1].any()


def test_a_torque_that_is_no_number_is_never_sent():
    made = driven("experiment-1", "law.gains.k3=[1e308, 1e308]", "law.gains.alpha=[1e308, 1e308]")
    run_until_trip(made)
    assert made.cycle.code == NO_TORQUE
    assert np.isfinite(made["torque"]).all()


def test_beyond_a_limit_it_trips_at_once_and_says_which():
    made = driven("experiment-1", "limits.F_m.upper=5.0")
    run_until_trip(made)
    F_m, state = made["F_m"], made["state"]
    last = np.flatnonzero(state == State.RUNNING)[-1]
    assert made.cycle.code == LIMIT
    assert F_m[last] > 5 and (F_m[:last] <= 5).all()
    assert made.cycle.reason == f"F_m = {F_m[last]:.6g} N is above its limit 5"


def test_a_lower_limit_of_a_vector_holds_for_each_entry():
    made = driven("experiment-1", "limits.q_dot.lower=-0.2")
    run_until_trip(made)
    last = np.flatnonzero(made["state"] == State.RUNNING)[-1]
    assert (made["q_dot"][:last] >= -0.2).all() and (made["q_dot"][last] < -0.2).any()
    assert "is below its limit -0.2" in made.cycle.reason


def test_a_signal_that_is_no_number_trips():
    tiny = ", ".join(["1e-306"] * 10)
    made = driven("experiment-1", f"law.Gamma_r=[{tiny}]")
    run_until_trip(made)
    assert (made.cycle.code, made.cycle.reason) == (NOT_FINITE, "V_r is infinite or not a number")


def test_a_plant_that_is_lost_trips_and_comes_back_by_a_reset():
    made = driven("experiment-1", "testbed.motors.limit=[1e12, 1e12]", "limits={}")
    made.command(Kind.START)
    made.ticks(5)
    made.command(Kind.KICK, 0, [1e12, 1e12, 1.0])
    while made.cycle.state is State.RUNNING:
        made.ticks(1)
    assert made.cycle.code == DEVICE_LOST
    assert "plant" in made.cycle.reason
    made.ticks(5)
    assert made.command(Kind.RESET) == ""
    assert made.command(Kind.START) == ""
    assert np.isfinite(made.ticks(10)).all()


def test_what_the_clock_finds_trips_as_well_and_the_first_reason_stays():
    made = driven()
    made.command(Kind.START)
    made.ticks(5)
    made.cycle.trip(DEADLINES, "late")
    made.cycle.trip(LIMIT, "something else")
    assert not made.of(made.ticks(5), "torque").any()
    assert (made.cycle.code, made.cycle.reason) == (DEADLINES, "late")


def test_a_limit_of_what_no_row_has_is_refused():
    chosen = scenario("experiment-1", "limits.clipped.upper=0.5")
    device = SimulatedTestbed(chosen.closed_loop, chosen.start, 0, "vm")
    with pytest.raises(AlightError, match=r"limits\.clipped"):
        Cycle(Bank.of(chosen), device, "vm")


# Commands

SIZE = len(parameter_column(scenario().closed_loop))
SAMPLE_RATE = 2000.0


@st.composite
def commands(draw):
    """A command that may or may not make sense, as (kind, law, values)."""
    kind, law = draw(st.sampled_from(list(Kind))), draw(st.integers(0, 4))
    made = driven_columns()
    if kind is Kind.KICK:
        return kind, law, draw(st.lists(st.floats(-50, 50), min_size=2, max_size=4))
    if kind not in (Kind.PARAMETERS, Kind.LAW):
        return kind, 0, ()
    column = made[law % 3].copy()
    for at in draw(st.lists(st.integers(0, len(column) - 1), max_size=2)):
        column[at] *= draw(st.sampled_from([1.0, 1.5, -1.0, np.nan, np.inf]))
    return kind, law, column[: draw(st.sampled_from([None, None, 3]))]


def driven_columns() -> list[np.ndarray]:
    return [parameter_column(loop) for loop in Bank.of(scenario()).loops]


STEPS = st.lists(st.one_of(st.integers(1, 12), commands()), max_size=25)
TWINS: list[Driven] = []


@settings(max_examples=60)
@given(steps=STEPS)
def test_whatever_is_asked_torque_is_zero_unless_running_and_a_refusal_changes_nothing(steps):
    """A twin that is spared the refused commands gives the same rows."""
    if not TWINS:
        TWINS.extend([Driven(scenario()), Driven(scenario())])
    made, twin = TWINS
    for each in TWINS:
        each.begin()
    for step in steps:
        if isinstance(step, int):
            np.testing.assert_array_equal(made.ticks(step)[:, 9:], twin.ticks(step)[:, 9:])
            continue
        before = made.cycle.state
        if reason := made.command(*step):
            assert made.cycle.state is before and len(reason) > 10
        else:
            assert twin.command(*step) == ""
        assert (made.cycle.state, made.cycle.law) == (twin.cycle.state, twin.cycle.law)
        assert made.cycle.command == made.number
    if made.kept:
        idle = made["state"] != State.RUNNING
        assert not made["torque"][idle].any() and not made["kick"][idle].any()
        assert np.isfinite(made["torque"]).all()
        assert set(made["state"]) <= set(State)


@pytest.mark.parametrize(
    ("kind", "law", "values", "words"),
    [
        (Kind.START, 0, (), "is RUNNING: reset"),
        (Kind.RESET, 0, (), "is RUNNING: stop"),
        (Kind.KICK, 0, (1.0, 1.0, 0.0), "must be above 0"),
        (Kind.KICK, 0, (1.0, 1.0, 2 * LONGEST_KICK), "at most"),
        (Kind.KICK, 0, (1.0, np.nan, 1.0), "three finite"),
        (Kind.KICK, 0, (1.0,), "three finite"),
        (Kind.PARAMETERS, 1, (), "not in force"),
        (Kind.PARAMETERS, 0, (1.0,), "numbers, not 1"),
        (Kind.LAW, 9, (), "there are 3"),
    ],
)
def test_a_command_that_makes_no_sense_is_refused_with_the_reason(kind, law, values, words):
    made = driven()
    made.command(Kind.START)
    assert words in made.command(kind, law, values)
    assert made.cycle.state is State.RUNNING


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"gains__k1": -1.0}, "k1"),
        ({"target__x_md": 5.0}, "reach"),
    ],
)
def test_parameters_are_taken_as_a_whole_or_not_at_all(values, words):
    made = driven()
    made.command(Kind.START)
    names = {"gains__k1": "law.gains.k1", "target__x_md": "law.target.x_md"}
    column = made.changed(gains__k2=0.9)
    (path, value), *_ = values.items()
    column[position(made, names[path])] = value
    assert words in made.command(Kind.PARAMETERS, 0, column)
    np.testing.assert_array_equal(
        made.ticks(50)[:, 9:], driven_rows(50)[:, 9:], err_msg="k2 was taken"
    )


def driven_rows(count: int) -> np.ndarray:
    """Rows of a run that nobody disturbs."""
    fresh = Driven(scenario())
    fresh.command(Kind.START)
    return fresh.ticks(count)


def position(made: Driven, path: str) -> int:
    """Where a parameter stands in the column of the first law."""
    from alight.simulation.law_tick import law_parameters
    from alight.symbolic.parameters import lift

    loop = made.bank.loops[0]
    paths = [p for name, part in law_parameters(loop).items() for p in lift(part, f"{name}.").paths]
    return paths.index(path)


def test_the_sample_rate_is_not_for_a_command():
    made = driven()
    column = parameter_column(made.bank.loops[0])
    column[column == SAMPLE_RATE] = 1000.0
    assert "testbed.sample_rate" in made.command(Kind.PARAMETERS, 0, column)


@given(factors=st.lists(st.floats(0.5, 2.0), min_size=9, max_size=9))
def test_a_column_of_parameters_and_a_law_are_the_same_thing(factors):
    loop = scenario().closed_loop
    gains = loop.law.gains  # type: ignore[attr-defined]
    names = ("k1", "k2", "alpha1", "alpha2", "Gamma")
    scaled = dataclasses.replace(
        gains, **{n: getattr(gains, n) * f for n, f in zip(names, factors, strict=False)}
    )
    other = dataclasses.replace(loop, law=dataclasses.replace(loop.law, gains=scaled))
    assert with_parameters(loop, parameter_column(other)) == other
    assert with_parameters(loop, parameter_column(loop)) == loop
