"""What a scenario refuses, and that the message says file, field, value and remedy."""

from __future__ import annotations

from pathlib import Path

import pytest

from alight import AlightError, MassSpring, load_scenario
from alight.errors import InvalidParameters, UnknownName
from alight.scenarios.load import ScenarioError, parse_overrides
from tests.scenarios.bad_input import Bad, each_bad_input


@each_bad_input
def test_bad_input_is_refused_by_file_field_value_and_remedy(bad: Bad, tmp_path: Path):
    path = bad.write(tmp_path)
    with pytest.raises(ScenarioError) as caught:
        load_scenario(path, bad.settings)
    text = str(caught.value)
    assert caught.value.file == str(path) and text.startswith(f"{path}:\n")
    for part in bad.says:
        assert part in text
    assert isinstance(caught.value, AlightError) and isinstance(caught.value, ValueError)
    # No line repeats another, and none drowns its reader in a table that was refused as a whole.
    assert len(set(caught.value.problems)) == len(caught.value.problems)
    assert max(len(problem) for problem in caught.value.problems) < 300


def test_every_mistake_is_named_at_once():
    with pytest.raises(ScenarioError) as caught:
        load_scenario("experiment-1", ["plant.body.m=-1", "seed=-2", "testbed.probe.depth=3"])
    assert len(caught.value.problems) == 3


def test_alternatives_of_a_value_do_not_show_in_its_path():
    """One line for a number that may also be a list, under the name that stands in the file."""
    for value, path in (("nan", "initial"), ("[1.0, nan]", "initial.1"), ("'x'", "initial")):
        with pytest.raises(ScenarioError) as caught:
            load_scenario("experiment-1", [f"law.theta_dk.initial={value}"])
        (problem,) = caught.value.problems
        assert problem.startswith(f"law.theta_dk.{path} = ")


@pytest.mark.parametrize("name", ["experiment-3", "", "no/such/file", "x" * 5000, "a\0b"])
def test_an_unknown_scenario_lists_the_known_ones(name):
    with pytest.raises(UnknownName, match=r"unknown scenario .*experiment-1, experiment-2"):
        load_scenario(name)


def test_a_file_that_cannot_be_read_is_named_with_the_reason(tmp_path):
    for path, reason in ((tmp_path / "none.toml", "No such file"), (tmp_path, "directory")):
        with pytest.raises(ScenarioError, match=f"cannot be read: .*{reason}") as caught:
            load_scenario(path)
        assert caught.value.file == str(path)


@pytest.mark.parametrize("text", ["plant.body.m", "=3", "plant.body.m=", " = 3", "a..b=3", ".a=3"])
def test_an_override_must_read_path_equals_value(text):
    with pytest.raises(AlightError, match="must read path=value, as in"):
        parse_overrides([text])


def test_positional_arguments_are_refused_by_the_name_of_their_field():
    with pytest.raises(InvalidParameters, match=r"k_s = -2.0: Input should be greater than 0"):
        MassSpring(1.0, -2.0, 0.2)
