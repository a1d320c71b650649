"""Motors that clip at 240 and 20 N m, or at a lower artificial limit."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from hypothesis import given

from alight.errors import InvalidParameters
from alight.symbolic.build import build
from alight.testbed import Motors
from tests.strategies import log_between, vectors

TORQUES = vectors(2, 1e4)
LIMITED = Motors(artificial_limit=(44.0, 15.0))


def test_the_paper_motors():
    assert Motors().limit == (240.0, 20.0) and Motors().artificial_limit is None


@given(TORQUES)
def test_the_torque_stays_within_the_limits_and_is_untouched_inside(tau):
    limit = np.array(Motors().limit)
    clipped = Motors().clip(tau)
    assert (np.abs(clipped) <= limit).all()
    inside = np.abs(tau) <= limit
    assert (clipped[inside] == tau[inside]).all()
    assert (clipped[~inside] == (np.sign(tau) * limit)[~inside]).all()


@given(TORQUES)
def test_clipping_is_idempotent_and_odd(tau):
    for motors in (Motors(), LIMITED):
        clipped = motors.clip(tau)
        assert (motors.clip(clipped) == clipped).all()
        assert (motors.clip(-tau) == -clipped).all()


@given(TORQUES, log_between(1.0, 1e3), log_between(1.0, 1e3))
def test_the_lower_of_motor_and_artificial_limit_holds_for_each_joint(tau, first, second):
    clipped = Motors(artificial_limit=(first, second)).clip(tau)
    lower = Motors(limit=(min(240.0, first), min(20.0, second)))
    assert (clipped == lower.clip(tau)).all()


@given(TORQUES)
def test_numbers_and_expressions_are_clipped_alike(tau):
    symbol = ca.SX.sym("tau", 2)
    for motors in (Motors(), LIMITED):
        clip = build("clip", {"tau": symbol}, {"clipped": motors.clip(symbol)})
        assert (clip(tau).full()[:, 0] == motors.clip(tau)).all()


@pytest.mark.parametrize("field", ["limit", "artificial_limit"])
def test_limits_must_be_two_positive_numbers(field):
    for wrong in ((240.0, 0.0), (240.0, -20.0), (240.0,), (240.0, float("inf"))):
        with pytest.raises(InvalidParameters, match=field):
            Motors(**{field: wrong})
