"""Numbers in messages and quantities at the joints: nothing is lost but the step."""

from __future__ import annotations

import math

from hypothesis import assume, given
from hypothesis import strategies as st

from alight.live.devices.cia402.scales import INT16, AngleScale, LengthScale, TorqueScale

GEARS = st.floats(0.1, 500)
DIRECTIONS = st.sampled_from([1, -1])


@given(st.floats(0.01, 500), GEARS, DIRECTIONS, st.floats(-1e4, 1e4))
def test_a_torque_comes_back_to_within_half_a_per_mille_of_the_rated_one(
    rated: float, gear: float, direction: int, torque: float
) -> None:
    scale = TorqueScale(rated, gear, direction)
    raw = scale.to_raw(torque)
    assert abs(raw) <= INT16
    if abs(torque) <= INT16 * rated * gear / 1000:
        assert abs(scale.to_torque(raw) - torque) <= rated * gear / 2000 * (1 + 1e-9)
    else:
        assert raw == math.copysign(INT16, torque * direction)


@given(st.integers(-INT16, INT16), st.floats(0.01, 500), GEARS, DIRECTIONS)
def test_every_number_of_a_message_comes_back(
    raw: int, rated: float, gear: float, direction: int
) -> None:
    scale = TorqueScale(rated, gear, direction)
    assert scale.to_raw(scale.to_torque(raw)) == raw


def test_rated_torque_is_a_thousand_and_the_gear_multiplies_it() -> None:
    assert TorqueScale(20.0).to_raw(20.0) == 1000
    assert TorqueScale(2.0, gear=50.0, direction=-1).to_raw(25.0) == -250


@given(st.floats(1, 1e7), GEARS, DIRECTIONS, st.floats(-7, 7), st.floats(-7, 7))
def test_an_angle_comes_back_to_within_half_an_increment(
    increments: float, gear: float, direction: int, zero: float, angle: float
) -> None:
    scale = AngleScale(increments, gear, direction, zero)
    step = 2 * math.pi / (increments * gear)
    assert abs(scale.to_angle(scale.to_raw(angle)) - angle) <= step / 2 * (1 + 1e-6)


def test_a_turn_of_the_joint_is_gear_turns_of_the_motor() -> None:
    scale = AngleScale(4096, gear=100, direction=-1, zero=0.25)
    assert math.isclose(scale.to_angle(-409600), 2 * math.pi + 0.25)


@given(st.floats(1e-9, 1e-3), DIRECTIONS, st.floats(-1, 1), st.floats(-1, 1))
def test_a_length_comes_back_to_within_half_a_step(
    step: float, direction: int, offset: float, position: float
) -> None:
    assume(step > 0)
    scale = LengthScale(step * direction, offset)
    assert abs(scale.to_position(scale.to_raw(position)) - position) <= step / 2 * (1 + 1e-6)
