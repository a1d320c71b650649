"""Laws of one's own: a class on the error system, any other law, one in ordinary Python."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import alight
from alight import AdaptiveContactLaw, AlightError, ForceLimiting, Law, Measurement, PlainLaw, Tick
from alight.errors import InvalidParameters
from alight.scenarios.load import ScenarioError
from alight.symbolic.ops import Vector, as_vector, fabs, tanh, vector
from alight.symbolic.parameters import Positive, Quantity, parameters
from alight.symbolic.signals import Signal
from tests.cli.command import OWN_ARM


class Softsign(AdaptiveContactLaw):
    """Another saturation than (32)'s."""

    def feedback(self, e_r: Vector, r_r: Vector) -> Vector:
        return e_r / (1 + fabs(e_r)) + as_vector(self.gains.k3) * r_r / (1 + fabs(r_r))


@parameters
class Spring(Law):
    """Pulls the joints to a pose through a soft saturation, and counts the time."""

    stiffness: Annotated[Positive, Quantity("N m", "largest pull")] = 5.0
    states: ClassVar[Mapping[str, Signal]] = {"elapsed": Signal("s", "time since the start")}
    signals: ClassVar[Mapping[str, Signal]] = {"pull": Signal("N m", "pull on joint 1")}

    def initial_state(self) -> dict[str, Any]:
        return {"elapsed": 0.0}

    def tick(self, state: Mapping[str, Any], measured: Measurement, dt: Any) -> Tick:
        pull = -self.stiffness * tanh(measured.q[0] - 1.0)
        tau = vector(pull - measured.q_dot[0], -0.5 * measured.q_dot[1] + 0.1 * measured.x_m)
        return Tick(tau, {"elapsed": state["elapsed"] + dt}, {"pull": pull})


class PlainSpring(PlainLaw):
    """The same in ordinary Python."""

    states = Spring.states
    signals = Spring.signals

    def __init__(self, stiffness: float = 5.0) -> None:
        self.stiffness = stiffness

    def initial_state(self) -> dict[str, Any]:
        return {"elapsed": 0.0}

    def tick(self, state: Mapping[str, Any], measured: Measurement, dt: float) -> Tick:
        pull = -self.stiffness * math.tanh(measured.q[0] - 1.0)
        tau = [pull - measured.q_dot[0], -0.5 * measured.q_dot[1] + 0.1 * measured.x_m]
        return Tick(np.array(tau), {"elapsed": state["elapsed"] + dt}, {"pull": pull})


class PlainForceLimiting(PlainLaw):
    """The paper's law, evaluated on floats."""

    signals = ForceLimiting.signals
    trips = ForceLimiting.trips

    def __init__(self, law: ForceLimiting) -> None:
        self.law = law
        self.states = law.states

    def initial_state(self) -> Mapping[str, Any]:
        return self.law.initial_state()

    def tick(self, state: Mapping[str, Any], measured: Measurement, dt: float) -> Tick:
        return self.law.tick(state, measured, dt)


IDEAL = ("testbed.encoder.counts=0", "testbed.transducer.resolution=0")
"""Sensors that do not magnify a difference in the last bit to a whole count."""


def scenario(duration: float = 0.4, *settings: str) -> alight.Scenario:
    return alight.load_scenario(
        OWN_ARM, [f"duration={duration}", f"steady_state={duration / 4}", *settings]
    )


def assert_close(one: alight.Recording, other: alight.Recording) -> None:
    """Equal to rounding, each signal by its own scale."""
    assert one.columns == other.columns and len(one) == len(other)
    scale = np.abs(other.samples).max(axis=0)
    apart = np.abs(one.samples - other.samples).max(axis=0)
    wrong = apart > 1e-9 * scale + 1e-12
    assert not wrong.any(), [one.columns[i] for i in np.flatnonzero(wrong)]


# A class on the error system


def test_a_class_on_the_error_system_gets_the_table_of_the_scenario():
    chosen = scenario()
    run = alight.simulate(chosen, law=Softsign)
    assert run.verdict.completed and run["Lambda"].any()
    assert isinstance(chosen.law, ForceLimiting)
    mine = Softsign(
        model=chosen.plant,
        target=chosen.target,
        **{k: v for k, v in chosen.document.law.items() if k != "type"},
    )
    assert (mine.gains, mine.theta_r, mine.Gamma_r) == (
        chosen.law.gains,
        chosen.law.theta_r,
        chosen.law.Gamma_r,
    )
    np.testing.assert_array_equal(alight.simulate(chosen, law=mine).samples, run.samples)


def test_the_feedback_of_the_class_is_what_acts():
    chosen = scenario()
    run = alight.simulate(chosen, law=Softsign)
    feedback = run["F"] - run["F_feedforward"]
    e_r, r_r = run["e_r"], run["r_r"]
    expected = e_r / (1 + abs(e_r)) + np.array(chosen.law.gains.k3) * r_r / (1 + abs(r_r))
    np.testing.assert_allclose(feedback, expected, atol=1e-12 * abs(run["F"]).max())
    assert (abs(feedback) < 1 + np.array(chosen.law.gains.k3)).all()


def test_law_as_class_and_law_by_name_are_one(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "soft_law.py").write_text(
        "from alight import AdaptiveContactLaw\n"
        "from alight.symbolic.ops import as_vector, fabs\n"
        "class Softsign(AdaptiveContactLaw):\n"
        "    def feedback(self, e_r, r_r):\n"
        "        shaped = as_vector(self.gains.k3) * r_r / (1 + fabs(r_r))\n"
        "        return e_r / (1 + fabs(e_r)) + shaped\n"
    )
    path = tmp_path / "mine.toml"
    path.write_text(
        f'extends = "{OWN_ARM}"\nduration = 0.4\nsteady_state = 0.1\n'
        '[law]\ntype = "soft_law:Softsign"\n'
    )
    by_file = alight.simulate(path)
    by_set = alight.simulate(scenario(0.4, "law.type=soft_law:Softsign"))
    by_class = alight.simulate(scenario(0.4), law=Softsign)
    np.testing.assert_array_equal(by_file.samples, by_class.samples)
    np.testing.assert_array_equal(by_set.samples, by_class.samples)


# Any other law, by name, with settings of its own


@pytest.mark.parametrize("name", ["Spring", "PlainSpring"])
def test_another_law_by_name_has_a_table_of_its_own(tmp_path, name):
    law = f"{__name__}:{name}"
    path = tmp_path / "mine.toml"
    path.write_text(f'extends = "{OWN_ARM}"\n[law]\ntype = "{law}"\nstiffness = 2.5\n')
    assert alight.load_scenario(path).law.stiffness == 2.5
    by_set = alight.load_scenario(OWN_ARM, ["law.stiffness=1.5", f"law.type={law}"])
    assert by_set.law.stiffness == 1.5
    assert [p for p in by_set.provenance if p.startswith("law.")] == ["law.type", "law.stiffness"]
    with pytest.raises(ScenarioError, match="stiffnes"):
        alight.load_scenario(OWN_ARM, ["law.stiffnes=1.5", f"law.type={law}"])


def test_settings_of_ones_own_law_are_checked_by_its_own_annotations():
    law = f"{__name__}:Spring"
    with pytest.raises(ScenarioError, match=r"law.stiffness = -1: .*greater than 0"):
        alight.load_scenario(OWN_ARM, ["law.stiffness=-1", f"law.type={law}"])


def test_an_error_within_ones_own_law_is_not_hidden():
    """It is a defect of that law, and needs its traceback."""

    class Broken(PlainLaw):
        states: ClassVar[Mapping[str, Signal]] = {}

        def initial_state(self) -> dict[str, Any]:
            return {}

        def tick(self, state: Mapping[str, Any], measured: Measurement, dt: float) -> Tick:
            return Tick(measured.no_such_thing, {}, {})

    with pytest.raises(AttributeError, match="no_such_thing") as caught:
        alight.simulate(scenario(), law=Broken)
    assert not isinstance(caught.value, AlightError)


def test_what_is_no_law_is_refused():
    with pytest.raises(AlightError, match="dict is not a subclass"):
        alight.simulate(scenario(), law=dict)
    with pytest.raises(AlightError, match="Needy cannot be made: missing a required argument"):
        alight.simulate(scenario(), law=Needy)
    with pytest.raises(AlightError, match="AdaptiveContactLaw does not say what its feedback is"):
        alight.simulate(scenario(), law=AdaptiveContactLaw)


class Needy(PlainSpring):
    """Cannot be made without an argument."""

    def __init__(self, something: float) -> None:
        super().__init__(something)


# Ordinary Python


@settings(max_examples=5)
@given(stiffness=st.floats(0.1, 50.0))
def test_a_law_in_ordinary_python_is_the_same_law(stiffness):
    chosen = scenario(0.2, "testbed.transducer.noise=1e-6", *IDEAL)
    plain = alight.simulate(chosen, law=PlainSpring(stiffness))
    written = alight.simulate(chosen, law=Spring(stiffness))
    assert_close(plain, written)


def test_the_papers_law_evaluated_on_floats_is_the_same_law():
    chosen = scenario(0.05, *IDEAL)
    assert isinstance(chosen.law, ForceLimiting)
    plain = alight.simulate(chosen, law=PlainForceLimiting(chosen.law))
    assert_close(plain, alight.simulate(chosen))


def test_channels_are_recorded_alike():
    chosen = scenario(0.02)
    for law in (Spring(), PlainSpring()):
        run = alight.simulate(chosen, law=law, channels=("pull", "x_r"))
        assert set(run.columns) == {"pull", "x_r1", "x_r2"}


def test_a_parameter_of_a_law_says_what_it_is_by_position_too():
    with pytest.raises(InvalidParameters, match=r"stiffness = -1\.0"):
        Spring(-1.0)
