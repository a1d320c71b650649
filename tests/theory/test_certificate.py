"""The certificate of a scenario says what its parts find, and what it does not know."""

from __future__ import annotations

import dataclasses
import json
import re

import numpy as np
import pytest

import alight
from alight.theory import Certificate, check, page, tables, vtx_margin
from alight.theory.answers import answers
from alight.theory.assumed import Assumed
from tests.theory.certificates import EXAMPLES, certificate

SHORT = {"duration": 0.4, "steady_state": 0.1}
SHORT_ARM = str(EXAMPLES / "own_arm.toml")
FAST = [1e14, 1e10, 1e5, 2e13, 2e9, 2e4, 1e13, 1e9, 1e4, 1e13]
NAMES = ["experiment-1", "experiment-2", "own_arm.toml"]


def holds(made: Certificate, number: str) -> bool | None:
    return made.condition(number).holds


def assumption(made: Certificate, what: str) -> Assumed:
    (found,) = [line for line in made.assumed if what in line.what]
    return found


# What the issue with the paper's gains is


@pytest.mark.parametrize("reading", ["printed", "corrected"])
def test_the_gains_of_experiment_1_fail_the_papers_conditions(reading):
    theorem = getattr(certificate("experiment-1").theorem_1, reading)
    failing = {c.number for c in theorem.conditions if c.holds is False}
    assert {"(26)", "(38), first", "(38), second", "(70), k2"} <= failing
    assert ("(70), k1" in failing) == (reading == "printed")
    assert theorem.holds is False and not any(c.holds for c in theorem.joint)


def test_LOC_fails_for_42_and_holds_for_the_gains_of_experiment_2():
    assert holds(certificate("experiment-1"), "LOC") is False
    assert holds(certificate("experiment-2"), "LOC") is True


@pytest.mark.parametrize("name", NAMES)
def test_the_nearest_gains_satisfy_VTX_over_all_of_the_assumptions(name):
    made = certificate(name)
    bounds, rng = made.case.bounds, np.random.default_rng(0)
    assert made.nearest is not None
    for _ in range(200):
        m, K_I = rng.uniform(bounds.m_l, bounds.m_u), rng.uniform(*bounds.zeta_K)
        assert vtx_margin(made.nearest, m, K_I) > 0
    kept = made.nearest == made.case.law.gains
    assert kept == (holds(made, "VTX") is True)


def test_proposition_D_has_numbers_where_lambda_exists_and_theorem_1_does_not_imply_it():
    specimen = certificate("feasible-design.toml")
    D, corrected = specimen.condition("D"), specimen.theorem_1.corrected
    assert corrected.holds and D.holds is False
    assert D.left == corrected.constant("eps_x").value
    rate = corrected.constant("lambda").value
    assert rate is not None and D.right == pytest.approx(rate * np.tanh(0.03) ** 2)
    assert "lambda is undefined" in certificate("experiment-1").condition("D").undefined


# Verdict and answers


def test_an_arm_with_gentle_gains_is_certified_and_the_experiments_are_not():
    assert [certificate(name).certified for name in NAMES] == [False, False, True]


@pytest.mark.parametrize(
    ("change", "because"),
    [
        ({"law.gains.alpha1": 55.0}, "LOC fails, 55 < "),
        ({"law.gains.alpha3": 0.01}, "VTX fails"),
        ({"law.Gamma_r": FAST}, "the adaptation is too fast for the samples"),
        ({"assumptions.m_u": 1.9}, "m_l < m < m_u"),
    ],
)
def test_what_takes_the_certificate_away_is_named(change, because):
    made = check(alight.load_scenario(SHORT_ARM, {**SHORT, **change}))
    assert not made.certified
    assert because in " ".join(answers(made))


def test_answers_of_experiment_1():
    stable, force, assuming = answers(certificate("experiment-1"))
    assert "LOC fails, 55 < 37.6 1/s is false" in stable and "clip stops theta_r_hat4" in stable
    assert "axis X1 96 N, axis X2 6 N" in force and "no proof keeps it there" in force
    assert "the contact is the spring (7)" in assuming


def test_of_a_law_that_saturates_nothing_no_force_is_said_to_be_limited():
    _, force, _ = answers(certificate("experiment-2"))
    assert force.startswith("Neither the feedback nor the rest of the force is limited.")


# Assumptions


def test_assumptions_are_held_against_plant_and_run():
    made = certificate("experiment-1")
    assert assumption(made, "K_I within zeta_K").holds
    assert "kelvin-voigt" in assumption(made, "the spring (7)").found
    assert not assumption(made, "the motors give").holds
    assert assumption(made, "continuous time").found == "sampled at 2000 Hz"


def test_on_the_papers_own_model_sampling_alone_and_the_run_are_left():
    lossless = {
        "plant.contact": {"type": "linear-spring", "K_I": 1e5},
        "plant.tip_friction.mu": 0.0,
        "plant.body.damping": 0.0,
        "plant.arm.viscous": [0.0, 0.0],
    }
    made = check(alight.load_scenario("experiment-1", {**lossless, **SHORT}))
    broken = [line.about for line in made.assumed if not line.holds]
    assert "model" not in broken and "testbed" in broken


@pytest.mark.parametrize(("a1", "holds"), [(0.05, True), (5.0, False)])
def test_a_wide_box_needs_a1_which_is_held_against_the_arm(a1, holds):
    wide = list(alight.load_scenario(SHORT_ARM).law.theta_r.upper)
    wide[8] = 1.0
    made = check(
        alight.load_scenario(SHORT_ARM, {"law.theta_r.upper": wide, "assumptions.a1": a1, **SHORT})
    )
    assert made.case.inertia.a1 == a1
    assert assumption(made, "M_bar no smaller").holds is holds
    assert made.certified is holds


def test_a_truth_outside_its_box_is_seen_by_entry():
    lower = [1.0] * 10
    upper = list(alight.load_scenario("experiment-1").law.theta_r.upper)
    lower[2], upper[2], upper[9] = 0.07, 0.3, 1.1e5
    made = check(
        alight.load_scenario(
            "experiment-1",
            {
                "law.theta_r.lower": [min(a, b) for a, b in zip(lower, INITIAL, strict=True)],
                "law.theta_r.upper": upper,
                "law.theta_r.initial": [*INITIAL[:9], 1e5],
                **SHORT,
            },
        )
    )
    found = assumption(made, "theta_r within its box")
    assert not found.holds and found.found == "entries [3, 10] outside"


INITIAL = list(alight.load_scenario("experiment-1").law.theta_r.initial)


# Page and file


@pytest.mark.parametrize("name", NAMES)
def test_the_page_holds_every_condition_with_both_sides_and_a_sentence(name):
    made = certificate(name)
    text = page(made).replace("&lt;", "<").replace("\\|", "|")
    readings = made.theorem_1.printed, made.theorem_1.corrected
    conditions = [*made.propositions, *(c for r in readings for c in r.conditions)]
    assert len(conditions) > 25
    for c in conditions:
        assert c.statement in text and c.meaning in text and c.meaning.endswith(".")
        if c.undefined:
            assert c.undefined in text
    for bound in made.newtons:
        assert bound.meaning in text
    assert "F_m = K_I max(0, Y_d theta_dk_hat + k2 tanh(e_m)" in text
    assert text.startswith(f"# Certificate of {made.scenario.name}: ")
    assert "nan" not in re.findall(r"\b(?:nan|inf)\b", text)


@pytest.mark.parametrize("name", NAMES)
def test_the_file_is_plain_json_without_nan(name):
    made = certificate(name)
    text = json.dumps(made.as_dict(), allow_nan=False)
    found = json.loads(text)
    assert found["certified"] == made.certified
    for reading in ("printed", "corrected"):
        for condition in found["theorem_1"][reading]["conditions"]:
            if condition["left"] is None or condition["right"] is None:
                assert condition["undefined"] and condition["margin"] is None
    assert len(found["newtons"]) == len(made.newtons)


def test_every_row_of_every_table_has_its_cells():
    for made in map(certificate, NAMES):
        for table in tables(made):
            assert table.rows or table.notes
            assert all(len(row) == len(table.columns) for row in table.rows)


# Pictures


def test_V_r_stays_below_its_bound_where_the_run_is_that_of_the_model():
    """The shipped plant has friction; its V_r rises above what is owed nowhere in this run."""
    traces = certificate("experiment-1").lyapunov
    assert traces["V_r"].t[-1] > 9.9
    assert traces["V_r over the boxes"].excess < 0


def test_the_region_agrees_with_the_conditions_at_its_points():
    made = certificate("experiment-1")
    plane, gains, nearest = made.region, made.case.law.gains, made.nearest
    assert nearest is not None

    def at(margin: np.ndarray, g: alight.Gains) -> float:
        i = np.abs(np.log(plane.k1 / g.k1)).argmin()
        j = np.abs(np.log(plane.alpha1 / g.alpha1)).argmin()
        return float(margin[i, j])

    assert at(plane.LOC, gains) < 0 < at(plane.LOC, nearest)
    assert at(plane.VTX, gains) < 0
    moved = dataclasses.replace(nearest, alpha1=nearest.alpha1 / 2)
    assert at(plane.VTX_moved, moved) > 0 > at(plane.VTX_moved, gains)
    assert at(plane.LOC, gains) == pytest.approx(made.condition("LOC").margin, abs=1.0)


def test_a_run_that_breaks_up_still_has_a_certificate():
    made = check(alight.load_scenario("experiment-1", {"law.gains.alpha1": 5000.0, **SHORT}))
    assert not made.recording.verdict.completed and not made.certified
    assert "u_f can reach 1" in " ".join(answers(made))
    assert json.dumps(made.as_dict(), allow_nan=False)
