"""A draft becomes a scenario file that gives it back, and replaces none unasked."""

import pytest

import alight
from alight.errors import AlightError
from alight.files import FileError
from alight.live.bank import Bank
from alight.live.page.save import save_scenario
from alight.symbolic.parameters import replaced

DRAFT = {"law.gains.alpha1": 20.0, "law.gains.k3": (90.0, 6.0), "law.target.x_md": 0.23}
CASES = {
    "as shipped": ("experiment-1", {}),
    "the other": ("experiment-2", {}),
    "another plant": ("experiment-1", {"plant.body.m": 2.0, "limits.tau.upper": 500.0}),
}


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("number", [0, 1, 2])
def test_a_saved_draft_is_given_back_by_its_file(case, number, tmp_path):
    scenario = alight.load_scenario(*CASES[case])
    bank = Bank.of(scenario)
    loop = replaced(bank.loops[number], DRAFT)
    path = save_scenario(tmp_path / "new", "mine.toml", bank, number, loop)
    saved = alight.load_scenario(path)
    assert saved.law == loop.law
    assert (saved.plant, saved.testbed) == (scenario.plant, scenario.testbed)
    assert saved.target == loop.law.target
    assert "set at the live bench" in saved.provenance["law.gains.alpha1"].note
    assert f'extends = "{scenario.name}"' in path.read_text()


def test_a_scenario_that_is_not_shipped_is_written_out(tmp_path):
    text = save_text(tmp_path, "experiment-1")
    (tmp_path / "other.toml").write_text(text)
    scenario = alight.load_scenario(tmp_path / "other.toml")
    bank = Bank.of(scenario)
    loop = replaced(bank.loops[0], DRAFT)
    path = save_scenario(tmp_path, "again.toml", bank, 0, loop)
    (tmp_path / "other.toml").unlink()
    saved = alight.load_scenario(path)
    assert (saved.law, saved.plant) == (loop.law, scenario.plant)
    assert saved.provenance["testbed.sample_rate"].kind == "published"


def save_text(folder, name):
    bank = Bank.of(alight.load_scenario(name))
    return save_scenario(folder, "first.toml", bank, 0, bank.loops[0]).read_text()


def test_a_file_is_not_replaced_unasked(tmp_path):
    bank = Bank.of(alight.load_scenario("experiment-1"))
    path = tmp_path / "mine.toml"
    path.write_text("kept")
    with pytest.raises(FileError, match="is there already"):
        save_scenario(tmp_path, "mine.toml", bank, 0, bank.loops[0])
    assert path.read_text() == "kept"
    save_scenario(tmp_path, "mine.toml", bank, 0, bank.loops[0], replace=True)
    assert alight.load_scenario(path).law == bank.loops[0].law


@pytest.mark.parametrize(
    "name", ["../up.toml", "/etc/up.toml", "up", ".toml", "a\0.toml", "", "a/b.toml"]
)
def test_a_name_cannot_lead_elsewhere(name, tmp_path):
    bank = Bank.of(alight.load_scenario("experiment-1"))
    with pytest.raises(AlightError, match="no name for a scenario"):
        save_scenario(tmp_path, name, bank, 0, bank.loops[0])
    assert not list(tmp_path.iterdir())
