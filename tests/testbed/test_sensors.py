"""Resolvers, transducer and probe of Section V: quantisation, noise, backward difference."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from alight.models import PlantState
from alight.symbolic.build import build
from alight.testbed import Encoder, SensorState, Testbed, Transducer
from alight.testbed.sensors import quantize
from tests.strategies import between, log_between, vectors

VALUES = between(-10.0, 10.0)
RESOLUTIONS = log_between(1e-9, 1e-1)
COUNT = 2 * np.pi / 614400  # [rad]
IDEAL = Testbed(encoder=Encoder(counts=0.0), transducer=Transducer())


@given(VALUES, RESOLUTIONS)
def test_quantisation_is_idempotent(value, resolution):
    once = quantize(value, resolution)
    assert quantize(once, resolution) == once


@given(VALUES, RESOLUTIONS)
def test_quantisation_stays_within_half_a_step_and_lands_on_a_step(value, resolution):
    read = quantize(value, resolution)
    rounding = 4 * np.spacing(abs(value) + resolution)
    assert abs(read - value) <= resolution / 2 + rounding
    steps = read / resolution
    assert abs(steps - round(steps)) <= 1e-15 * abs(steps)


@given(VALUES, VALUES, RESOLUTIONS)
def test_quantisation_keeps_the_order(value, other, resolution):
    low, high = sorted((value, other))
    assert quantize(low, resolution) <= quantize(high, resolution)


@given(vectors(2, 10.0), between(-1.0, 1.0), between(-3.0, 3.0))
def test_a_resolution_of_zero_is_an_ideal_sensor(q, x_m, noise):
    assert (Encoder(counts=0.0).read(q) == q).all()
    assert Transducer(resolution=0.0, noise=0.0).read(x_m, noise) == x_m


@given(vectors(2, 10.0))
def test_the_paper_resolvers_have_614400_counts_per_revolution(q):
    read = Encoder().read(q)
    np.testing.assert_allclose(read / COUNT, np.round(read / COUNT), atol=1e-8)
    assert (np.abs(read - q) <= COUNT / 2 * (1 + 1e-9)).all()


@given(st.integers(-614400, 614400))
def test_every_count_can_be_read(count):
    read = Encoder().read(np.array([count * COUNT, -count * COUNT]))
    np.testing.assert_allclose(read, [count * COUNT, -count * COUNT], rtol=1e-14)


@given(between(-1.0, 1.0), between(0.0, 1e-3), RESOLUTIONS, between(-4.0, 4.0))
def test_noise_is_added_before_the_transducer_rounds(x_m, noise, resolution, standard):
    read = Transducer(resolution=resolution, noise=noise).read(x_m, standard)
    assert read == quantize(x_m + noise * standard, resolution)


@given(vectors(2, 10.0), VALUES, RESOLUTIONS)
def test_numbers_and_expressions_are_read_alike(q, x_m, resolution):
    angles, position, noise = ca.SX.sym("q", 2), ca.SX.sym("x_m"), ca.SX.sym("noise")
    encoder, transducer = Encoder(), Transducer(resolution=resolution, noise=1e-3)
    function = build(
        "read",
        {"q": angles, "x_m": position, "noise": noise},
        {"angles": encoder.read(angles), "position": transducer.read(position, noise)},
    )
    read = [v.full() for v in function(q, x_m, 0.5)]
    assert (read[0][:, 0] == encoder.read(q)).all()
    assert read[1] == transducer.read(x_m, 0.5)


def moving(t: float, start: PlantState) -> PlantState:
    return start._replace(q=start.q + t * start.q_dot, x_m=start.x_m + t * start.x_m_dot)


@st.composite
def ramps(draw: st.DrawFn) -> PlantState:
    return PlantState(
        q=draw(vectors(2, 3.0)),
        q_dot=draw(vectors(2, 5.0)),
        x_m=draw(between(-0.5, 0.5)),
        x_m_dot=draw(between(-2.0, 2.0)),
        z=0.0,
    )


@given(ramps(), log_between(10.0, 2e4))
def test_the_backward_difference_of_ideal_readings_is_exact_on_ramps(ramp, rate):
    testbed = Testbed(sample_rate=rate, encoder=IDEAL.encoder)
    before, now = (testbed.readings(moving(t, ramp), 0.0) for t in (0.0, 1 / rate))
    measured = testbed.measure(now, before)
    rounding = 1e-15 * rate * 10  # of positions up to 10 rad, over one sample
    np.testing.assert_allclose(measured.q_dot, ramp.q_dot, rtol=0, atol=rounding)
    assert measured.x_m_dot == pytest.approx(ramp.x_m_dot, abs=rounding)
    assert (measured.q == now.q).all() and measured.x_m == now.x_m


@given(ramps(), RESOLUTIONS)
def test_resolution_times_sample_rate_bounds_the_error_of_the_velocity(ramp, resolution):
    testbed = Testbed(transducer=Transducer(resolution=resolution))
    before, now = (testbed.readings(moving(t, ramp), 0.0) for t in (0.0, 1 / 2000))
    measured = testbed.measure(now, before)
    assert (np.abs(measured.q_dot - ramp.q_dot) <= COUNT * 2000 * (1 + 1e-9)).all()
    assert abs(measured.x_m_dot - ramp.x_m_dot) <= resolution * 2000 + 1e-10


def test_a_measurement_at_rest_shows_no_velocity():
    readings = SensorState(q=np.array([0.3, -1.2]), x_m=0.206)
    measured = Testbed().measure(readings, readings)
    assert not measured.q_dot.any() and measured.x_m_dot == 0
