"""Reading a scenario: inheritance, sources, overrides."""

from __future__ import annotations

import os
import tomllib
from pathlib import Path
from typing import Any

import pytest
import tomlkit
from hypothesis import assume, given
from hypothesis import strategies as st

from alight import load_scenario, shipped_scenarios
from alight.scenarios import Provenance
from alight.scenarios.load import ScenarioError, merge, parse_overrides, split_sources
from alight.scenarios.shipped import shipped_file

ABOUT_THE_FILE = {"title", "description", "extends", "provenance"}
"""Entries that are words about a file, and no values of the scenario."""

words = st.text("abcxyz_", min_size=1, max_size=4)
scalars = st.integers(-5, 5) | st.floats(allow_nan=False) | st.booleans() | st.text(max_size=4)
tables = st.recursive(
    st.dictionaries(words, scalars, max_size=4),
    lambda inner: st.dictionaries(words, scalars | inner, max_size=4),
    max_leaves=12,
)


def write(folder: Path, name: str, text: str) -> Path:
    path = folder / name
    path.parent.mkdir(exist_ok=True)
    path.write_text(text)
    return path


# The shipped scenarios


def unsourced(table: dict[str, Any], prefix: str = "") -> list[str]:
    """Path of each value that states neither where it is published nor why it is assumed."""
    found: list[str] = []
    for key, item in table.items():
        if not prefix and key in ABOUT_THE_FILE:
            continue
        if not isinstance(item, dict):
            found.append(f"{prefix}{key}")
        elif "value" not in item:
            found += unsourced(item, f"{prefix}{key}.")
        elif set(item) not in ({"value", "published"}, {"value", "assumed"}):
            found.append(f"{prefix}{key}")
    return found


@pytest.mark.parametrize("name", shipped_scenarios())
def test_every_value_of_a_shipped_scenario_is_published_or_assumed(name):
    content = tomllib.loads(shipped_file(name).read_text("utf-8"))
    assert unsourced(content) == []


@pytest.mark.parametrize("name", shipped_scenarios())
def test_the_sources_of_a_shipped_scenario_reach_its_user(name):
    scenario = load_scenario(name)
    assert scenario.title and scenario.document.description
    for path in ("plant.body.m", "start.x_r", "testbed.motors.limit", "law.gains.k3"):
        source = scenario.provenance[path]
        assert source.kind in ("published", "assumed") and source.note
    assert scenario.provenance["law.gains.k3"].kind == "published"
    assert scenario.provenance["plant.body.m"].kind == "assumed"


def test_both_experiments_have_one_plant():
    one, two = load_scenario("experiment-1"), load_scenario("experiment-2")
    assert one.plant == two.plant and one.start == two.start and one.target == two.target
    assert two.testbed.motors.artificial_limit is not None


# Inheritance


def test_a_chain_of_scenarios_is_merged_from_its_root(tmp_path):
    write(
        tmp_path,
        "middle.toml",
        'extends = "experiment-1"\ntitle = "middle"\nduration = { value = 3.0, assumed = "mine" }\n'
        "[plant.body]\nm = 7.0\n",
    )
    leaf = write(tmp_path, "leaf.toml", 'extends = "middle.toml"\n[plant.body]\nk_s = 123.0\n')
    root, scenario = load_scenario("experiment-1"), load_scenario(leaf)
    assert (scenario.name, scenario.title) == ("leaf", "middle")
    assert (scenario.plant.body.m, scenario.plant.body.k_s) == (7.0, 123.0)
    assert scenario.plant.body.x_0 == root.plant.body.x_0
    assert scenario.plant.arm == root.plant.arm
    assert scenario.provenance["duration"] == Provenance("assumed", "mine")
    assert scenario.provenance["plant.body.x_0"] == root.provenance["plant.body.x_0"]
    # A value that replaces another does not inherit the source of that.
    assert "plant.body.m" not in scenario.provenance


def test_a_parent_is_sought_beside_the_file_that_names_it(tmp_path, monkeypatch):
    write(tmp_path, "sub/base.toml", 'extends = "experiment-1"\nduration = 3.0\n')
    child = write(tmp_path, "sub/child.toml", 'extends = "base.toml"\n')
    monkeypatch.chdir(tmp_path)
    write(tmp_path, "base.toml", 'extends = "experiment-1"\nduration = 4.0\n')
    assert load_scenario(child).document.duration == 3.0
    assert load_scenario(Path("sub", "child.toml")).document.duration == 3.0


def test_a_parent_in_another_folder(tmp_path):
    write(tmp_path, "base.toml", 'extends = "experiment-1"\nduration = 3.0\n')
    child = write(tmp_path, "sub/child.toml", 'extends = "../base.toml"\n')
    assert load_scenario(child).document.duration == 3.0
    elsewhere = write(tmp_path, "abs.toml", f'extends = "{tmp_path / "base.toml"}"\n')
    assert load_scenario(elsewhere).document.duration == 3.0


def test_a_circle_is_refused_with_its_members(tmp_path):
    for name, parent in (("a", "b"), ("b", "c"), ("c", "a")):
        write(tmp_path, f"{name}.toml", f'extends = "{parent}.toml"\n')
    with pytest.raises(ScenarioError, match="extends itself") as caught:
        load_scenario(tmp_path / "a.toml")
    places = [str(caught.value).index(f"{name}.toml ->") for name in "abc"]
    assert places == sorted(places)


def test_a_circle_under_changing_names_is_seen_too(tmp_path):
    """Each round gives the path one more ``../here``."""
    path = write(tmp_path, "here/a.toml", 'extends = "../here/a.toml"\n')
    with pytest.raises(ScenarioError, match="extends itself"):
        load_scenario(path)
    link = tmp_path / "link.toml"
    link.symlink_to(write(tmp_path, "b.toml", 'extends = "link.toml"\n'))
    with pytest.raises(ScenarioError, match="extends itself"):
        load_scenario(tmp_path / "b.toml")


def test_another_contact_law_replaces_the_whole_of_the_old(tmp_path):
    path = write(
        tmp_path,
        "a.toml",
        'extends = "experiment-1"\n[plant.contact]\ntype = "hunt-crossley"\nK_I = 2e4\n',
    )
    contact = load_scenario(path).plant.contact
    assert (contact.type, contact.K_I) == ("hunt-crossley", 2e4)


def test_the_same_contact_law_keeps_what_is_not_stated(tmp_path):
    root = load_scenario("experiment-1").plant.contact
    path = write(
        tmp_path,
        "a.toml",
        f'extends = "experiment-1"\n[plant.contact]\ntype = "{root.type}"\nK_I = 2e4\n',
    )
    contact = load_scenario(path).plant.contact
    assert (contact.K_I, contact.damping) == (2e4, root.damping)


def test_another_law_of_the_error_system_keeps_the_settings(tmp_path):
    path = write(
        tmp_path,
        "a.toml",
        'extends = "experiment-1"\n[law]\ntype = "unsaturated"\n[law.gains]\nk1 = 0.5\n',
    )
    old, new = load_scenario("experiment-1").law, load_scenario(path).law
    assert type(new).__name__ == "Unsaturated"
    assert new.gains.k1 == 0.5 and new.gains.k2 == old.gains.k2 and new.theta_r == old.theta_r


def test_the_exact_model_needs_no_estimates():
    law = load_scenario("experiment-1", ["law.type=exact-model"]).law
    assert tuple(law.states) == ("u_f",)


@given(tables)
def test_merging_adds_what_is_new_and_keeps_what_is_not_replaced(table):
    assert merge(table, {}) == merge({}, table) == merge(table, table) == table


@given(tables, tables)
def test_merging_leaves_its_inputs_alone_and_prefers_the_second(base, over):
    before = tomlkit.dumps(base), tomlkit.dumps(over)
    merged = merge(base, over)
    assert (tomlkit.dumps(base), tomlkit.dumps(over)) == before
    assert set(merged) == set(base) | set(over)
    for key, value in over.items():
        if not isinstance(value, dict):
            assert merged[key] == value


# Sources


def sourced(table: dict[str, Any], note: str) -> dict[str, Any]:
    """The same table with a source beside each value."""
    return {
        key: sourced(item, note) if isinstance(item, dict) else {"value": item, "published": note}
        for key, item in table.items()
    }


def paths(table: dict[str, Any], prefix: str = "") -> set[str]:
    found: set[str] = set()
    for key, item in table.items():
        inner = paths(item, f"{prefix}{key}.") if isinstance(item, dict) else {f"{prefix}{key}"}
        found |= inner
    return found


@given(tables)
def test_sources_are_separated_from_values_by_path(table):
    values, sources = split_sources(sourced(table, "(42)"))
    assert values == table
    assert sources == dict.fromkeys(paths(table), Provenance("published", "(42)"))
    assert split_sources(table) == (table, {})


# Overrides


@given(st.dictionaries(words, scalars, min_size=1))
def test_overrides_are_read_in_the_notation_of_toml(values):
    texts = [f"a.{key}={tomlkit.item(value).as_string()}" for key, value in values.items()]
    assert parse_overrides(texts) == {f"a.{key}": value for key, value in values.items()}


@given(st.from_regex(r"[a-z]+(-[a-z]+)?", fullmatch=True))
def test_words_need_no_quotes(word):
    assume(word not in ("true", "false", "inf", "nan"))
    assert parse_overrides([f"law.type={word}"]) == {"law.type": word}


def test_overrides_win_over_the_file_and_say_so():
    scenario = load_scenario(
        "experiment-1", ["plant.body.m=2.25", "law.gains.k3=[1.0, 2.0]", "testbed.delay=true"]
    )
    assert scenario.plant.body.m == 2.25
    assert scenario.law.gains.k3 == (1.0, 2.0)
    assert scenario.testbed.delay is True
    assert scenario.provenance["plant.body.m"] == Provenance("assumed", "set by the user")
    assert scenario.data["plant"]["body"]["m"] == 2.25
    same = load_scenario("experiment-1", {"plant.body.m": 2.25})
    assert same.plant == scenario.plant


def test_a_table_set_as_a_whole_takes_its_sources_with_it():
    contact = '{ type = "linear-spring", K_I = 3e4 }'
    scenario = load_scenario("experiment-1", [f"plant.contact={contact}"])
    assert scenario.plant.contact.K_I == 3e4
    inside = [path for path in scenario.provenance if path.startswith("plant.contact")]
    assert inside == ["plant.contact"]


def test_a_setting_that_the_file_leaves_out_can_be_set():
    scenario = load_scenario("experiment-1", ["plant.arm.coulomb=[0.5, 0.1]"])
    assert scenario.plant.arm.coulomb == (0.5, 0.1)


def test_a_file_with_a_byte_order_mark_is_read(tmp_path):
    path = tmp_path / "bom.toml"
    path.write_bytes(b"\xef\xbb\xbf" + b'extends = "experiment-1"\r\nduration = 3.0\r\n')
    assert load_scenario(path).document.duration == 3.0


def test_a_shipped_name_means_the_shipped_scenario_wherever_one_stands(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write(tmp_path, "experiment-1", 'extends = "experiment-2"\nduration = 3.0\n')
    assert load_scenario("experiment-1").document.duration != 3.0
    assert load_scenario(os.path.join(".", "experiment-1")).document.duration == 3.0
