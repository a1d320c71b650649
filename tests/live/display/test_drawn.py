"""What the plan view draws follows from the models, row by row."""

import numpy as np
import pytest

import alight
from alight.live.page.drawn import Drawn
from alight.live.replay import ReplaySource

SHORT = {"duration": 0.3, "steady_state": 0.1}


@pytest.fixture(scope="module")
def recording():
    return alight.simulate(alight.load_scenario("experiment-1", SHORT))


def rows_of(source, name):
    return source.read(0)[1][:, source.layout.slices()[name]]


def test_the_links_are_as_long_as_the_arm_says(recording):
    source = ReplaySource(recording)
    source.seek(source.rows)
    elbow, arm = rows_of(Drawn(source), "elbow"), source.scenario.plant.arm
    np.testing.assert_allclose(np.linalg.norm(elbow, axis=1), arm.l1, rtol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(recording["x_r"] - elbow, axis=1), arm.l2, rtol=1e-12)


def test_the_spring_gives_way_by_what_the_probe_loses(recording):
    source = ReplaySource(recording)
    source.seek(source.rows)
    deflection = rows_of(Drawn(source), "deflection")[:, 0]
    whole = source.scenario.testbed.probe.clearance
    np.testing.assert_allclose(deflection, whole - recording["probe_clearance"], atol=1e-15)
    assert deflection.max() > 0 and deflection.min() == 0


def test_what_was_not_recorded_is_not_drawn():
    few = alight.simulate(alight.load_scenario("experiment-1", SHORT), channels=("e_m",))
    source = ReplaySource(few)
    source.seek(source.rows)
    assert np.isnan(rows_of(Drawn(source), "elbow")).all()
