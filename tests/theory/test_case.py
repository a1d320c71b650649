"""What a certificate needs of a scenario, and what is said where it is missing."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import alight
from alight.errors import AlightError
from alight.scenarios.assumptions import Assumptions
from alight.theory.case import case_of
from alight.theory.condition import Condition

KNOWN = Assumptions(1.0, 2.0, (1e4, 1e5), (1e2, 1e3), -0.5, 0.3, 0.05)


def test_the_case_of_an_experiment_has_its_start_and_no_friction():
    scenario = alight.load_scenario("experiment-1")
    case = case_of(scenario)
    np.testing.assert_allclose(case.plant.arm.x_r(case.s.q), [0.060, 0.436], atol=1e-12)
    assert case.plant.body.damping == 0 and case.plant.arm.viscous == (0.0, 0.0)
    assert case.e.e_m == pytest.approx(0.030) and case.a.u_f == 0


def test_a_law_without_estimates_is_refused_with_those_that_have_them():
    scenario = alight.load_scenario("experiment-1", {"law.type": "exact-model"})
    with pytest.raises(AlightError, match=r"law.type = 'exact-model': .* force-limiting or unsat"):
        case_of(scenario)


def test_without_assumptions_there_is_no_certificate():
    scenario = alight.load_scenario("experiment-1")
    silent = dataclasses.replace(scenario.document, assumptions=None)
    with pytest.raises(AlightError, match=r"assumptions: missing; .* m_l, m_u, zeta_K"):
        case_of(dataclasses.replace(scenario, document=silent))


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"assumptions.m_l": 3.0}, r"m_l and m_u = 3, 2.7: the first must be the smaller"),
        ({"assumptions.zeta_K": [2e5, 1e5]}, r"zeta_K = 200000, 100000"),
        ({"assumptions.zeta_xr": 0.5}, r"zeta_xr and zeta_xm = 0.5, 0.3"),
        ({"assumptions.sigma_J": -1.0}, r"assumptions.sigma_J = -1.0: .*greater than 0"),
        ({"assumptions.m_max": 1.0}, r"assumptions.m_max: unknown name"),
    ],
)
def test_assumptions_that_contradict_themselves_are_refused(values, said):
    with pytest.raises(AlightError, match=said):
        alight.load_scenario("experiment-1", values)


@pytest.mark.parametrize(
    ("relation", "left", "right", "margin", "holds"),
    [
        (">", 2.0, 1.0, 1.0, True),
        (">", 1.0, 1.0, 0.0, False),
        (">=", 1.0, 1.0, 0.0, True),
        ("<", 2.0, 1.0, -1.0, False),
        ("<=", 1.0, 1.0, 0.0, True),
        ("<", None, 1.0, None, None),
    ],
)
def test_a_condition_holds_where_its_margin_says_so(relation, left, right, margin, holds):
    made = Condition("(0)", "left ? right", left, relation, right, "m", "a test")
    assert made.margin == margin and made.holds is holds


def test_a_condition_can_be_known_to_fail_without_a_margin():
    made = Condition("(0)", "x > y", None, ">", 1.0, "m", "a test", undefined="why", fails=True)
    assert made.margin is None and made.holds is False
