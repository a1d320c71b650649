"""``alight scenarios``: what ships, and every value with unit, meaning and source."""

from __future__ import annotations

import json
from typing import Any

import pytest

import alight
from alight.cli.scenarios import values_of
from alight.symbolic.parameters import numeric_fields
from tests.cli.command import OWN_ARM, invoke

EACH = pytest.mark.parametrize("name", [*alight.shipped_scenarios(), OWN_ARM])


def described(name: str) -> dict[str, dict[str, Any]]:
    result = invoke("scenarios", name, "--json")
    assert result.exit_code == 0 and result.stderr == ""
    return json.loads(result.stdout)


def test_the_list_holds_every_shipped_scenario_with_its_title():
    text = invoke("scenarios").stdout
    titles = json.loads(invoke("scenarios", "--json").stdout)
    assert sorted(titles) == alight.shipped_scenarios()
    for name, title in titles.items():
        assert title == alight.load_scenario(name).title
        assert name in text and title in text


@EACH
def test_every_number_that_is_simulated_is_listed_with_unit_and_meaning(name):
    """The inputs of the tick are these numbers: none may be left out."""
    found, scenario = described(name), alight.load_scenario(name)
    repeated = ("law.model.", "law.target.")
    for root, part in scenario.closed_loop.parameters().items():
        for path, value, quantity in numeric_fields(part, f"{root}."):
            if not path.startswith(repeated):
                stored = list(value) if isinstance(value, tuple) else value
                assert found[path]["value"] == stored
                assert found[path]["meaning"] == quantity.meaning != ""
                assert found[path]["unit"] == quantity.unit
    for path in ("start.x_r", "target.x_md", "duration", "law.type", "testbed.delay"):
        assert path in found


@EACH
def test_every_value_says_where_it_comes_from(name):
    scenario = alight.load_scenario(name)
    for value in values_of(scenario):
        source = scenario.provenance.get(value.path)
        if source is not None:
            assert (value.kind, value.note) == (source.kind, source.note)
        else:
            assert value.kind in ("stated", "default")


@pytest.mark.parametrize("name", alight.shipped_scenarios())
def test_what_a_shipped_scenario_states_is_published_or_assumed(name):
    kinds = {value["kind"] for value in described(name).values()}
    assert kinds <= {"published", "assumed", "default"}


def test_what_the_file_leaves_out_is_a_default():
    found = described(OWN_ARM)
    assert found["plant.arm.coulomb"]["kind"] == "default"
    assert found["plant.arm.l1"] == {
        "value": 0.4,
        "unit": "m",
        "meaning": "length of the base link",
        "kind": "assumed",
        "note": "drawing",
    }
    assert found["plant.body.m"]["kind"] == "stated"


def test_the_table_shows_values_units_meanings_and_sources():
    text = invoke("scenarios", "experiment-1").stdout
    for part in (
        "Experiment 1",
        *("path", "value", "unit", "meaning", "source"),
        *("law.gains.alpha1", "55", "1/s", "published: (42)"),
        *("testbed.motors.limit", "[240, 20]", "N m", "published: Section V"),
        *("plant.contact.type", "law.type", "force-limiting"),
        *("plant.arm.coulomb_speed", "default"),
    ):
        assert part in text


def test_a_law_of_ones_own_is_described_too(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "lazy_law.py").write_text(
        "import alight\n"
        "class Lazy(alight.PlainLaw):\n"
        "    states = {}\n"
        "    def __init__(self, laziness):\n"
        "        self.laziness = laziness\n"
        "    def initial_state(self):\n"
        "        return {}\n"
        "    def tick(self, state, measured, dt):\n"
        "        return alight.Tick([0.0, 0.0], {}, {})\n"
    )
    path = tmp_path / "lazy.toml"
    path.write_text(
        f'extends = "{OWN_ARM}"\n[law]\ntype = "lazy_law:Lazy"\n'
        'laziness = { value = 3.0, assumed = "by nature" }\n'
    )
    found = described(str(path))
    assert found["law.type"]["value"] == "lazy_law:Lazy"
    assert (found["law.laziness"]["value"], found["law.laziness"]["note"]) == (3.0, "by nature")
    assert not any(path.startswith("law.gains") for path in found)
