"""A `Controller` gives the torques of the simulation, sample by sample, and stops when in doubt."""

from __future__ import annotations

import functools
from typing import ClassVar

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import alight
from alight.control.transition import FILTER_TRIP
from alight.errors import AlightError, InvalidParameters, UnknownName
from alight.simulation.closed_loop import NO_TORQUE, PLANT, SENSORS, ClosedLoop
from alight.simulation.law_tick import NO_READING
from alight.symbolic.ops import vector
from alight.testbed import SensorState
from tests.cli.command import OWN_ARM
from tests.compiler import NEEDS_COMPILER

BACKENDS = pytest.mark.parametrize("backend", ["vm", pytest.param("c", marks=NEEDS_COMPILER)])
SHORT = ("duration=0.5", "steady_state=0.1")


@functools.cache
def scenario(name: str = OWN_ARM, *settings: str) -> alight.Scenario:
    return alight.load_scenario(name, [*SHORT, *settings])


@functools.cache
def recording(name: str = OWN_ARM, *settings: str) -> alight.Recording:
    return alight.simulate(scenario(name, *settings), backend="vm")


def before_the_start(loop: ClosedLoop, start: object) -> SensorState:
    """Readings one sample before a run begins, as the simulation has them."""
    column = loop.initial_column(start)  # type: ignore[arg-type]
    return SensorState(**SENSORS.unpack(column[PLANT.size : PLANT.size + SENSORS.size]))


def started(
    backend: str = "vm", name: str = OWN_ARM, *settings: str
) -> tuple[alight.Controller, np.ndarray]:
    """A controller that stands where a run begins, and the readings of that run."""
    chosen = scenario(name, *settings)
    controller = alight.Controller(chosen, backend)  # type: ignore[arg-type]
    controller.reset(before_the_start(chosen.closed_loop, chosen.start))
    run = recording(name, *settings)
    return controller, np.column_stack([run["q_measured"], run["x_m_measured"]])


# The torques of the simulation


@BACKENDS
@pytest.mark.parametrize(
    "of",
    [
        ("experiment-1",),
        ("experiment-2",),
        (OWN_ARM, "testbed.transducer.noise=1e-6"),
        ("experiment-1", "law.type=exact-model", "testbed.motors.artificial_limit=[30.0, 5.0]"),
    ],
)
def test_it_equals_the_recording_of_its_scenario_sample_by_sample(backend, of):
    """Readings of a run in, and the run's torque, signals and states out, to the last bit."""
    controller, readings = started(backend, *of)
    run = recording(*of)
    names = [name for name in controller.signals if name in run.layout.signals]
    law = scenario(*of).law
    assert {"tau", "q_dot_measured", *law.signals} <= set(names)
    for k, reading in enumerate(readings):
        before = {name: controller.signals[name].copy() for name in law.states}
        controller.reading[:] = reading
        controller.step()
        np.testing.assert_array_equal(controller.torque, run["tau_applied"][k])
        for name in names:
            value = before[name] if name in before else controller.signals[name]
            np.testing.assert_array_equal(value, np.atleast_1d(run[name][k]), err_msg=name)
    assert controller.trip == 0 and controller.reason == ""
    assert (run["Lambda"] > 0).any()


def test_calling_it_is_one_step():
    controller, readings = started()
    expected = recording()["tau_applied"][:50]
    found = [controller(reading[:2], reading[2]) for reading in readings[:50]]
    np.testing.assert_array_equal(found, expected)


def test_at_the_first_sample_velocities_are_zero_and_then_differences():
    chosen = scenario()
    controller = alight.Controller(chosen, "vm")
    q = np.array(chosen.start.q)
    controller(q, chosen.start.x_m)
    np.testing.assert_array_equal(controller.signals["q_dot_measured"], [0.0, 0.0])
    assert controller.signals["x_m_dot_measured"] == [0.0]
    controller(q + [1e-4, -2e-4], chosen.start.x_m + 3e-6)
    rate = chosen.testbed.sample_rate
    np.testing.assert_allclose(
        controller.signals["q_dot_measured"], [1e-4 * rate, -2e-4 * rate], rtol=1e-9
    )
    assert controller.signals["x_m_dot_measured"] == pytest.approx([3e-6 * rate], rel=1e-9)


@BACKENDS
def test_after_a_reset_it_does_the_same_again(backend):
    controller, readings = started(backend)
    first = [controller(reading[:2], reading[2]) for reading in readings[:100]]
    chosen = scenario()
    controller.reset(before_the_start(chosen.closed_loop, chosen.start))
    assert not controller.torque.any()
    again = [controller(reading[:2], reading[2]) for reading in readings[:100]]
    np.testing.assert_array_equal(first, again)


@BACKENDS
def test_arrays_keep_their_addresses(backend):
    controller, readings = started(backend)

    def addresses() -> list[int]:
        arrays = [controller.reading, controller.torque, *controller.signals.values()]
        return [array.ctypes.data for array in arrays]

    before = addresses()
    controller(readings[0][:2], readings[0][2])
    controller["law.gains.alpha1"] = 11.0
    controller.reset()
    assert addresses() == before


# Parameters


@BACKENDS
def test_a_gain_changes_at_the_next_sample_as_if_it_had_been_so(backend):
    """Nothing is built anew: the state goes on, and the new gain's law gives the next torque."""
    controller, readings = started(backend)
    for reading in readings[:200]:
        controller(reading[:2], reading[2])
    step, state = controller.step, controller.stepper.x.copy()
    unchanged = controller.torque.copy()
    controller["law.gains.k3"] = (60.0, 8.0)
    np.testing.assert_array_equal(controller.torque, unchanged)
    assert controller.step is step and (controller.stepper.x == state).all()
    torque = controller(readings[200][:2], readings[200][2])

    other = alight.Controller(scenario(OWN_ARM, "law.gains.k3=[60.0, 8.0]"), backend)
    other.stepper.x[:] = state
    np.testing.assert_array_equal(other(readings[200][:2], readings[200][2]), torque)
    controller["law.gains.k3"] = scenario().law.gains.k3  # type: ignore[attr-defined]
    controller.stepper.x[:] = state
    assert (controller(readings[200][:2], readings[200][2]) != torque).any()


@given(st.data())
def test_every_parameter_can_be_read_and_set_to_what_it_is(data):
    """And the rest stays: the loop it shows is then the scenario's own."""
    controller = shown()
    path = data.draw(st.sampled_from(controller.paths))
    before = controller.stepper.p.copy()
    controller[path] = controller[path]
    np.testing.assert_array_equal(controller.stepper.p, before)
    assert controller.loop == scenario().closed_loop


@functools.cache
def shown() -> alight.Controller:
    return alight.Controller(scenario(), "vm")


def test_every_path_that_is_offered_has_an_effect_and_the_gains_are_among_them():
    """Numbers that the law never reads, such as the plant's mass, are not offered."""
    paths = shown().paths
    assert len(set(paths)) == len(paths)
    gains = {"k1", "k2", "k3", "alpha1", "alpha2", "alpha3", "alpha", "Gamma"}
    assert {f"law.gains.{name}" for name in gains} <= set(paths)
    assert {"law.target.x_md", "testbed.motors.limit", "law.theta_r.upper"} <= set(paths)
    unread = ("law.model.body.m", "testbed.transducer.noise", "law.theta_r.initial")
    assert not set(unread) & set(paths)


@pytest.mark.parametrize("path", ["law.gains.alpha9", "plant.body.m", "gains", "law", ""])
def test_an_unknown_path_is_refused_with_those_there_are(path):
    for access in (lambda: shown()[path], lambda: shown().update({path: 1.0})):
        with pytest.raises(UnknownName, match=r"one of: law\.Gamma_r, law\.gains\.Gamma") as error:
            access()
        assert error.value.allowed == sorted(shown().paths)


@pytest.mark.parametrize(
    ("path", "value", "says"),
    [
        ("law.gains.alpha1", -1.0, "greater than 0"),
        ("law.gains.alpha1", float("nan"), "finite"),
        ("law.gains.alpha1", "fast", "valid number"),
        ("law.gains.k3", 5.0, "list of values"),
        ("law.Gamma_r", (1.0, 2.0), "needs 10 entries"),
        ("law.theta_dk.upper", -1e9, "lower"),
        ("testbed.sample_rate", 0.0, "greater than 0"),
    ],
)
def test_a_value_that_is_refused_changes_nothing(path, value, says):
    controller = alight.Controller(scenario(), "vm")
    before = controller.stepper.p.copy()
    with pytest.raises(InvalidParameters, match=says):
        controller.update({"law.gains.k1": 77.0, path: value})
    np.testing.assert_array_equal(controller.stepper.p, before)
    assert controller.loop == scenario().closed_loop


def test_values_that_only_fit_together_are_set_together():
    controller = alight.Controller(scenario(), "vm")
    lower, upper = (controller[f"law.theta_dk.{name}"] for name in ("lower", "upper"))
    moved = {"law.theta_dk.lower": upper + 1, "law.theta_dk.upper": 2 * upper - lower + 1}
    with pytest.raises(InvalidParameters):
        controller["law.theta_dk.lower"] = moved["law.theta_dk.lower"]
    with pytest.raises(AlightError):
        controller.update(moved)  # the start of the estimate is no longer between its bounds


def test_what_changes_the_computation_needs_a_new_controller():
    controller = alight.Controller(
        scenario(OWN_ARM, "testbed.motors.artificial_limit=[30.0, 5.0]"), "vm"
    )
    assert controller["testbed.motors.artificial_limit"] == (30.0, 5.0)
    with pytest.raises(AlightError, match="another shape needs a new Controller"):
        controller["testbed.motors.artificial_limit"] = None


# When it stops


@BACKENDS
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("place", [0, 1, 2])
@pytest.mark.parametrize("at", [0, 40])
def test_a_reading_that_is_no_number_stops_it_for_good(backend, value, place, at):
    controller, readings = started(backend)
    for reading in readings[:at]:
        assert controller(reading[:2], reading[2]).any()
    state = controller.stepper.x[:-1].copy()
    bad = readings[at].copy()
    bad[place] = value
    np.testing.assert_array_equal(controller(bad[:2], bad[2]), [0.0, 0.0])
    for reading in readings[at + 1 : at + 5]:
        np.testing.assert_array_equal(controller(reading[:2], reading[2]), [0.0, 0.0])
        assert controller.trip == NO_READING
        assert controller.reason == "a reading is infinite or not a number"
    np.testing.assert_array_equal(controller.stepper.x[:-1], state)
    controller.reset()
    assert controller.trip == 0 and controller.reason == ""
    assert controller(readings[0][:2], readings[0][2]).any()


@BACKENDS
def test_a_trip_of_the_law_stops_it_with_the_laws_own_reason(backend):
    """The same trip that ends the simulation, at the same sample."""
    of = (OWN_ARM, "law.gains.alpha1=5000")
    run = recording(*of)
    assert not run.verdict.completed
    controller, readings = started(backend, *of)
    for reading in readings[:-1]:
        controller(reading[:2], reading[2])
        assert controller.trip == 0
    np.testing.assert_array_equal(controller(readings[-1][:2], readings[-1][2]), [0.0, 0.0])
    assert controller.trip == FILTER_TRIP
    assert controller.reason == scenario(*of).law.trips[FILTER_TRIP] == run.verdict.cause


class Dividing(alight.Law):
    """Divides by a joint angle."""

    states: ClassVar = {}

    def initial_state(self) -> dict[str, float]:
        return {}

    def tick(self, state, measured, dt):
        return alight.Tick(vector(1 / measured.q[0], 2.0), {}, {})


@BACKENDS
def test_a_torque_that_is_no_number_is_not_clipped_to_the_limit(backend):
    controller = alight.Controller(scenario().with_law(Dividing()), backend)
    np.testing.assert_array_equal(controller((0.5, 0.0), 0.3), [2.0, 2.0])
    np.testing.assert_array_equal(controller((0.0, 0.0), 0.3), [0.0, 0.0])
    assert controller.trip == NO_TORQUE and "torque" in controller.reason
    assert controller.paths == ("testbed.sample_rate", "testbed.motors.limit")


# What it is made of


def test_a_closed_loop_is_as_good_as_its_scenario():
    of_loop = alight.Controller(scenario().closed_loop, "vm")
    of_scenario, readings = started()
    of_loop.reset(before_the_start(scenario().closed_loop, scenario().start))
    q, x_m = readings[0][:2], readings[0][2]
    np.testing.assert_array_equal(of_loop(q, x_m), of_scenario(q, x_m))


def test_two_controllers_do_not_meet():
    (one, readings), (other, _) = started(), started()
    for reading in readings[:20]:
        one(reading[:2], reading[2])
    assert not other.torque.any()


class Plain(alight.PlainLaw):
    """Pushes."""

    states: ClassVar = {}

    def initial_state(self) -> dict[str, float]:
        return {}

    def tick(self, state, measured, dt):
        return alight.Tick(np.ones(2), {}, {})


def test_what_has_no_law_to_compile_is_refused():
    with pytest.raises(AlightError, match="Plain is a law in ordinary Python"):
        alight.Controller(scenario().with_law(Plain()))
    with pytest.raises(AlightError, match=r"a Scenario is needed, .* not a str"):
        alight.Controller("experiment-1")  # type: ignore[arg-type]
    with pytest.raises(UnknownName, match="unknown backend 'gpu'"):
        alight.Controller(scenario(), "gpu")  # type: ignore[arg-type]
