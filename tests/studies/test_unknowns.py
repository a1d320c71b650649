"""The unknowns of the identification: ranges, mapping, and the scenarios they give."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from alight.control import AdaptiveContactLaw
from alight.errors import AlightError
from alight.scenarios import load_scenario
from alight.studies.unknowns import NAMES, UNKNOWNS, plant_of, point_of, settings_of, values_at

points = st.lists(st.floats(0, 1), min_size=len(NAMES), max_size=len(NAMES)).map(np.array)


@given(points)
def test_values_stay_in_their_ranges_and_lead_back_to_their_point(point):
    values = values_at(point)
    for name, unknown in UNKNOWNS.items():
        assert unknown.low * (1 - 1e-12) <= values[name] <= unknown.high * (1 + 1e-12)
    clipped = {n: min(max(v, UNKNOWNS[n].low), UNKNOWNS[n].high) for n, v in values.items()}
    assert np.allclose(point_of(clipped), point, atol=1e-9)


@given(points)
def test_every_candidate_has_a_positive_definite_inertia(point):
    arm = plant_of(values_at(point)).arm
    for q2 in (0.0, np.pi / 2, np.pi):
        assert np.linalg.eigvalsh(arm.M(np.array([0.3, q2]))).min() > 0


@settings(max_examples=15, deadline=None)
@given(points)
def test_the_boxes_of_every_candidate_hold_the_truth(point):
    """The theory asks for true parameters inside the projection bounds."""
    values = values_at(point)
    values.update(l1=0.33, l2=0.3)  # any arm that reaches start and target
    both, second = settings_of(values, "+")
    for name, overrides in (("experiment-1", both), ("experiment-2", {**both, **second})):
        scenario = load_scenario(name, overrides)
        law = scenario.law
        assert isinstance(law, AdaptiveContactLaw)
        truth = np.asarray(law.theta_r_of(law.pi_of(scenario.plant)))
        assert np.all(np.array(law.theta_r.lower) <= truth)
        assert np.all(truth <= np.array(law.theta_r.upper))
        assert law.theta_dk.lower <= scenario.plant.theta_dk <= law.theta_dk.upper


def test_a_value_out_of_range_or_unknown_is_refused():
    values = values_at(np.full(len(NAMES), 0.5))
    with pytest.raises(AlightError, match="m = 1000 is not between"):
        point_of({**values, "m": 1000.0})
    with pytest.raises(AlightError, match="needs"):
        point_of({**values, "mass": 1.0})
