"""`alight.inspect` against values computed elsewhere with 60 digits (``vectors.json``)."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import alight
from alight.control import Estimate
from alight.symbolic.derive import jacobian

VECTORS = json.loads((Path(__file__).parent / "vectors.json").read_text("utf-8"))
CASES = VECTORS["cases"]
TOLERANCE = {"V_dot": 1e-7, "V_r_dot": 1e-7}  # they hold large terms that cancel; else 1e-9

EACH_CASE = pytest.mark.parametrize("case", CASES, ids=lambda case: f"case {case['id']}")


@EACH_CASE
def test_every_signal_of_a_case(case):
    found, expected = alight.inspect(case["inputs"]), case["expected"]
    assert set(found) == set(expected)
    for name, value in expected.items():
        truth = np.asarray(value, dtype=float)
        assert np.shape(found[name]) == truth.shape, name
        bound = TOLERANCE.get(name, 1e-9) * np.abs(truth).max()
        np.testing.assert_allclose(found[name], truth, rtol=0, atol=bound, err_msg=name)


def test_the_cases_cover_contact_free_motion_and_an_active_projection():
    assert {case["contact"] for case in CASES} == {True, False}
    assert {case["dk_projection_active"] for case in CASES} == {True, False}


@EACH_CASE
def test_46_as_printed_lacks_a_term_where_the_projection_acts(case):  # erratum E2
    found = alight.inspect(case["inputs"])
    printed, right = found["x_rd_ddot_eq46_printed"], found["x_rd_ddot_AD"]
    assert (printed[0] != right[0]) == case["dk_projection_active"]


@pytest.mark.parametrize("gain_set", ["exp1", "exp2"])
def test_the_printed_order_of_31_is_far_off_with_the_gains_of_the_experiments(gain_set):
    """Erratum E1: ``alpha M_bar`` in place of ``M_bar alpha``."""
    misses = []
    for case in CASES:
        if case["gain_set"] == gain_set:
            v = alight.inspect(case["inputs"])
            alpha = np.diag(case["inputs"]["gains"]["alpha"])
            M, C = v["Mbar"], v["Cbar"]
            miss = (alpha @ M - M @ alpha) @ v["e_r_dot"] + (alpha @ C - C @ alpha) @ v["e_r"]
            misses.append(np.linalg.norm(miss) / np.linalg.norm(v["W_eq31"]))
    assert min(misses) > 0.1


@pytest.mark.parametrize("vector", VECTORS["scalar_projection"])
def test_projection_and_its_slopes(vector: dict[str, Any]):
    low, high, mu, theta = (vector[name] for name in ("lo", "hi", "mu", "theta"))
    h = (high - low) / 2
    estimate = Estimate(
        (low + high) / 2,
        low,
        high,
        margin=vector["eps"] / h,
        leak=vector["delta"] / h**2,
        order=vector["n"],
    )
    found = {
        "proj": estimate.project(mu, theta),
        "dproj_dmu": jacobian(lambda v: estimate.project(v, theta), mu),
        "dproj_dtheta": jacobian(lambda v: estimate.project(mu, v), theta),
    }
    for name, value in found.items():
        assert value == pytest.approx(vector[name], rel=1e-9, abs=1e-300), name
