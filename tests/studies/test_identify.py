"""The search: seeded, resumable, and honest about what it found."""

import json
import tomllib

import pytest

from alight.errors import AlightError
from alight.scenarios import load_scenario
from alight.scenarios.load import identification_of
from alight.studies import identify
from alight.studies.identify import shipped_values
from alight.studies.misfit import evaluate, misfit
from alight.studies.unknowns import point_of


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    folder = tmp_path_factory.mktemp("search")
    return folder, identify(folder, generations=2, seed=3, workers=1)


def test_a_search_goes_on_where_it_stopped(found, tmp_path):
    """One generation, then a second, gives the costs of two generations in one go."""
    folder, whole = found
    identify(tmp_path, generations=1, seed=3, workers=1)
    resumed = identify(tmp_path, generations=2, seed=3, workers=1)
    assert json.loads((tmp_path / "identification.json").read_text()) == json.loads(
        (folder / "identification.json").read_text()
    )
    assert resumed == whole


def test_the_result_is_the_best_candidate_of_the_log(found):
    folder, result = found
    log = json.loads((folder / "identification.json").read_text())
    best = min(min(costs) for costs in log["generations"])
    assert result.best.cost == pytest.approx(best, rel=1e-9)


def test_the_scenarios_written_hold_the_plant_found_and_its_cost(found):
    folder, result = found
    scenario = load_scenario(folder / "experiment-1.toml")
    assert scenario.plant.body.m == pytest.approx(result.best.values["m"], rel=1e-9)
    second = load_scenario(folder / "experiment-2.toml")
    assert second.plant == scenario.plant  # one plant for both experiments
    limits = [result.best.values["limit1"], result.best.values["limit2"]]
    assert second.testbed.motors.artificial_limit == pytest.approx(limits, rel=1e-9)
    record = identification_of(folder / "experiment-1.toml")
    assert sum(record["costs"].values()) == pytest.approx(result.best.cost, rel=1e-2)
    assert tomllib.loads((folder / "experiment-1.toml").read_text())["law"]["gains"]["k1"] == {
        "value": 2.0,
        "published": "(42)",
    }


def test_the_log_of_another_search_is_refused(found):
    folder, _ = found
    before = (folder / "identification.json").read_bytes()
    with pytest.raises(AlightError, match="belongs to another search"):
        identify(folder, generations=2, seed=4, workers=1)
    assert (folder / "identification.json").read_bytes() == before


def test_a_damaged_log_is_refused(tmp_path):
    (tmp_path / "identification.json").write_text("{")
    with pytest.raises(AlightError, match="is no log"):
        identify(tmp_path, generations=1, workers=1)


def test_the_shipped_plant_has_the_cost_that_its_provenance_states():
    record = identification_of("experiment-1")
    values = shipped_values()
    elbow = load_scenario("experiment-1").data["start"]["elbow"]
    assert misfit(point_of(values), elbow) == pytest.approx(sum(record["costs"].values()), rel=0.02)


def test_the_misfit_tells_good_candidates_from_bad_ones():
    """Less friction leads away from the paper."""
    values = shipped_values()
    elbow = load_scenario("experiment-1").data["start"]["elbow"]
    assert evaluate(values, elbow).cost < evaluate({**values, "mu": 0.2}, elbow).cost


def test_a_candidate_out_of_reach_is_refused_by_its_cost():
    """Links of 0.3 m and 0.13 m end 1 cm short of the start (40)."""
    assert list(evaluate({**shipped_values(), "l1": 0.3, "l2": 0.13}, "+").costs) == ["refused"]
