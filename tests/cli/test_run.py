"""``alight run``: what it prints, what it keeps, and how it ends."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import matplotlib.image
import numpy as np
import pytest

import alight
from alight.cli.summary import Summary
from tests.cli.command import OWN_ARM, SHORT, TRIPS, invoke, process

FILES = ["plan.png", "recording.mcap", "recording.parquet", "summary.json", "torques.png"]


def refuse(text: str) -> Any:
    raise AssertionError(f"{text} is no JSON")


def read(text: str) -> dict[str, Any]:
    return json.loads(text, parse_constant=refuse)


def run_json(*args: str) -> dict[str, Any]:
    result = invoke("run", OWN_ARM, *SHORT, "--json", *args)
    assert result.exit_code == 0 and result.stderr == ""
    return read(result.stdout)


@pytest.fixture(scope="module")
def kept(tmp_path_factory) -> tuple[Path, str]:
    """Files and JSON of one run."""
    out = tmp_path_factory.mktemp("kept") / "deep" / "down"
    result = invoke("run", OWN_ARM, *SHORT, "--json", "--out", str(out))
    assert result.exit_code == 0
    return out, result.stdout


# What is printed


def test_the_table_holds_what_a_person_asks_first():
    result = invoke("run", OWN_ARM, *SHORT)
    assert result.exit_code == 0 and result.stderr == ""
    found = run_json()
    text = result.stdout
    for row in (
        "Own arm against a plate on a spring",
        "ran to its end at 0.3995 s",
        f"{found['contact_time']:.4f} s",
        f"{found['peak_F_m']:.4g} N",
        f"{found['least_probe_clearance'] * 1e3:.4g} mm",
        *(f"{value:.4g} N m" for value in found["peak_tau"]),
        *(f"{value:.4g} N m" for value in found["peak_tau_applied"]),
        "120 N m",
        "40 N m",
        "peak |e_r1| in the last 0.05 s",
        "peak |e_r2|",
        "peak |e_m|",
    ):
        assert row in text


def test_the_figures_are_those_of_the_recording():
    settings = [setting for setting in SHORT if setting != "--set"]
    scenario = alight.load_scenario(OWN_ARM, settings)
    run, found = alight.simulate(scenario), run_json()
    touching = run["Lambda"] > 0
    assert found["contact_time"] == run.t[touching].min()
    assert found["peak_F_m"] == run["F_m"].max() > 0
    assert found["least_probe_clearance"] == run["probe_clearance"].min()
    assert found["peak_tau"] == abs(run["tau"]).max(axis=0).tolist()
    assert found["peak_tau_applied"] == abs(run["tau_applied"]).max(axis=0).tolist()
    end = run.t > run.t[-1] - 0.05
    assert found["peak_e_m"] == abs(run["e_m"][end]).max()
    assert [found["peak_e_r1"], found["peak_e_r2"]] == abs(run["e_r"][end]).max(axis=0).tolist()
    assert found["completed"] is True and found["verdict"]["outcome"] == "completed"
    assert (found["scenario"], found["law"]) == ("own_arm", "force-limiting")


def test_every_figure_states_its_unit():
    found = run_json()
    figures = {key for key, value in found.items() if isinstance(value, (float, list))}
    assert figures <= set(found["units"])
    assert all(found["units"].values())


def test_the_lower_of_both_limits_is_shown():
    found = run_json("--set", "testbed.motors.artificial_limit=[5.0, 60.0]")
    assert found["motor_limit"] == [5.0, 40.0]
    assert found["peak_tau_applied"][0] == 5.0 < found["peak_tau"][0]


def test_a_run_without_contact_says_so():
    never = ("--set", "duration=0.01", "--set", "steady_state=0.005")
    assert run_json(*never)["contact_time"] is None
    assert "never" in invoke("run", OWN_ARM, *never).stdout


def test_signals_that_a_law_does_not_record_are_not_made_up(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "still_law.py").write_text(
        "import numpy as np\n"
        "import alight\n"
        "class Still(alight.PlainLaw):\n"
        "    states = {}\n"
        "    def initial_state(self):\n"
        "        return {}\n"
        "    def tick(self, state, measured, dt):\n"
        "        return alight.Tick(np.zeros(2), {}, {})\n"
    )
    still = ("--set", "law.type=still_law:Still", "--set", "duration=0.05")
    result = invoke("run", OWN_ARM, *SHORT, *still)
    assert result.exit_code == 0 and result.stdout.count("not recorded") == 3
    found = run_json(*still)
    assert found["peak_e_m"] is None and found["peak_tau"] == [0.0, 0.0]
    assert found["law"] == "still_law:Still"


def test_words_in_brackets_are_printed_as_they_stand():
    result = invoke("run", OWN_ARM, *SHORT, "--set", 'title="[bold]after [48] [/nothing] :smile:"')
    assert "[bold]after [48] [/nothing] :smile:" in result.stdout


# Options


def test_a_law_in_the_current_folder_is_found(tmp_path):
    (tmp_path / "my_law.py").write_text("from alight import Unsaturated as Mine\n")
    mine = process("run", OWN_ARM, *SHORT, "--json", "--set", "law.type=my_law:Mine", cwd=tmp_path)
    assert mine.returncode == 0, mine.stderr
    same = run_json("--set", "law.type=unsaturated")
    assert read(mine.stdout)["peak_F_m"] == same["peak_F_m"]


def test_the_seed_and_nothing_else_decides_about_the_noise():
    noisy = ("--set", "testbed.transducer.noise=1e-5")
    one, again, other = (run_json(*noisy, "--seed", seed) for seed in ("1", "1", "2"))
    assert one == again and (one["seed"], other["seed"]) == (1, 2)
    assert one["peak_F_m"] != other["peak_F_m"]
    assert run_json(*noisy, "--set", "seed=2") == other


def test_the_virtual_machine_gives_the_same_figures():
    assert run_json("--backend", "vm") == run_json("--backend", "auto")


# Files


def test_no_files_unless_they_are_asked_for(tmp_path):
    done = process("run", OWN_ARM, *SHORT, cwd=tmp_path)
    assert done.returncode == 0 and done.stderr == ""
    assert os.listdir(tmp_path) == []


def test_the_folder_is_made_and_holds_the_run(kept):
    out, stdout = kept
    assert sorted(os.listdir(out)) == FILES
    assert read((out / "summary.json").read_text()) == read(stdout)


def test_the_kept_recordings_are_the_run(kept):
    out, _ = kept
    settings = [setting for setting in SHORT if setting != "--set"]
    run = alight.simulate(alight.load_scenario(OWN_ARM, settings))
    for name in ("recording.parquet", "recording.mcap"):
        loaded = alight.Recording.load(out / name)
        assert loaded.columns == run.columns and loaded.verdict == run.verdict
        assert loaded.samples.tobytes() == run.samples.tobytes()
        assert loaded.scenario["plant"]["arm"]["l1"] == 0.4


@pytest.mark.parametrize("name", ["plan.png", "torques.png"])
def test_the_pictures_open_and_show_something(kept, name):
    picture = matplotlib.image.imread(kept[0] / name)
    assert min(picture.shape[:2]) > 100
    assert picture[..., :3].std() > 0.01


def test_a_second_run_into_the_same_folder_replaces_the_first(tmp_path):
    for k2 in ("0.1", "0.3"):
        args = ("run", OWN_ARM, *SHORT, "--set", f"law.gains.k2={k2}", "--out", str(tmp_path))
        assert invoke(*args).exit_code == 0
    assert sorted(os.listdir(tmp_path)) == FILES
    loaded = alight.Recording.load(tmp_path / "recording.parquet")
    assert loaded.scenario["law"]["gains"]["k2"] == 0.3


# Runs that end early


def test_a_run_that_ends_early_fails_with_its_verdict_and_keeps_its_recording(tmp_path):
    out = tmp_path / "early"
    result = invoke("run", OWN_ARM, *TRIPS, "--out", str(out))
    assert result.exit_code == 1
    for part in ("ended at", "u_f", "e_f escaped to infinity", "use smaller gains"):
        assert part in " ".join(result.stdout.split())
    assert sorted(os.listdir(out)) == FILES
    loaded = alight.Recording.load(out / "recording.parquet")
    assert loaded.verdict.outcome is alight.Outcome.TRIPPED
    run = alight.simulate(alight.load_scenario(OWN_ARM, [TRIPS[1]]))
    assert loaded.samples.tobytes() == run.samples.tobytes()


@pytest.mark.parametrize(
    ("settings", "outcome", "pictures"),
    [
        (TRIPS, "tripped", 2),
        (("--set", "plant.body.m=1e-9"), "diverged", 2),
        (("--set", "law.gains.Gamma=1e300"), "not_finite", 2),
        (
            (
                *("--set", "testbed.motors.limit=[1e300, 1e300]"),
                *("--set", "law.gains.k3=[1e200, 1e200]"),
            ),
            "diverged",
            0,  # nothing but the start is a number
        ),
    ],
)
def test_what_is_kept_of_a_run_that_ends_early_is_whole(settings, outcome, pictures, tmp_path):
    result = invoke("run", OWN_ARM, *settings, "--json", "--out", str(tmp_path))
    assert result.exit_code == 1
    found = read(result.stdout)
    assert found["completed"] is False and found["verdict"]["outcome"] == outcome
    assert found["verdict"]["signal"] and found["verdict"]["cause"]
    assert found["peak_e_m"] is found["peak_e_r1"] is found["peak_e_r2"] is None
    assert read((tmp_path / "summary.json").read_text()) == found
    for name in ("recording.parquet", "recording.mcap"):
        assert alight.Recording.load(tmp_path / name).verdict.outcome.name.lower() == outcome
    assert len(list(tmp_path.glob("*.png"))) == pictures


def test_the_verdict_of_a_process_is_its_exit_code():
    done = process("run", OWN_ARM, *TRIPS)
    assert done.returncode == 1
    assert "ended at" in done.stdout and done.stderr == ""


def test_peaks_pass_over_what_is_no_number():
    scenario = alight.load_scenario(OWN_ARM, [setting for setting in SHORT if setting != "--set"])
    run = alight.simulate(scenario)
    at = run.columns.index("F_m")
    peak = float(np.abs(run["F_m"]).max())
    run.samples[-1, at] = np.nan
    assert Summary(run, scenario, 0).as_dict()["peak_F_m"] == peak
    run.samples[:, at] = np.inf
    assert Summary(run, scenario, 0).as_dict()["peak_F_m"] is None


def test_the_environment_of_these_tests_reaches_the_process():
    """Otherwise another Alight than the one under test would have run above."""
    done = process("--version")
    assert (done.returncode, done.stdout) == (0, f"{alight.__version__}\n")
