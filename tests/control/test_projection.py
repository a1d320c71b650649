"""The projection of [48] on an interval: what the stability proof needs of it, and its clip."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from alight.control import Estimate
from alight.errors import AlightError, InvalidParameters
from alight.symbolic.build import build
from alight.symbolic.derive import jacobian
from tests.control.cases import told, within
from tests.strategies import between, log_between

ROUNDING = 1e-12


@st.composite
def intervals(draw: st.DrawFn, order: int | None = None) -> Estimate:
    """Bounds of one parameter, of any size and sign."""
    half = draw(log_between(1e-4, 1e6))
    centre = draw(between(-5.0, 5.0)) * half
    return Estimate(
        centre,
        centre - half,
        centre + half,
        margin=draw(log_between(1e-2, 1.0)),
        leak=draw(log_between(1e-6, 1.0)),
        order=draw(st.integers(1, 3)) if order is None else order,
    )


@st.composite
def moving(draw: st.DrawFn, order: int | None = None) -> tuple[Estimate, float, float]:
    """An interval, a rate of the size that crosses it within 1 us to 1000 s, and an estimate."""
    estimate = draw(intervals(order))
    mu = draw(st.sampled_from([-1.0, 1.0])) * draw(log_between(1e-3, 1e6)) * estimate.half_width
    return estimate, mu, draw(within(estimate))


def centre(estimate: Estimate) -> float:
    return (estimate.lower + estimate.upper) / 2


# P1-P4


@given(moving(), st.sampled_from([-1, 1]))
def test_p1_the_border_of_the_widened_interval_sends_every_rate_inwards(drawn, side):
    estimate, mu, _ = drawn
    h, epsilon = estimate.half_width, estimate.epsilon
    phi = side * (h + epsilon)
    P = estimate.project(mu, centre(estimate) + phi)
    delta = estimate.leak * h**2
    bound = (phi * mu - np.sqrt((phi * mu) ** 2 + delta**2)) / 2
    assert bound <= 0
    assert phi * P <= bound + 1e-7 * abs(phi * mu) + 1e-7 * delta  # phi carries the rounding of c


@given(moving(), between(0.0, 1.0))
def test_p2_it_never_takes_the_estimate_away_from_any_truth_within_the_bounds(drawn, share):
    estimate, mu, theta = drawn
    truth = estimate.lower + share * (estimate.upper - estimate.lower)
    gain = (truth - theta) * (estimate.project(mu, theta) - mu)
    assert gain >= -ROUNDING * abs(mu) * estimate.half_width


@given(moving())
def test_p3_it_is_bounded(drawn):
    estimate, mu, theta = drawn
    h, reach = estimate.half_width, estimate.half_width + estimate.epsilon
    delta = estimate.leak * h**2
    bound = abs(mu) * (1 + (reach / h) ** 2) + delta * reach / (2 * h**2)
    assert abs(estimate.project(mu, theta)) <= bound * (1 + ROUNDING)


@given(moving())
def test_within_the_bounds_it_is_the_rate_itself(drawn):
    estimate, mu, theta = drawn
    assume(estimate.lower < theta < estimate.upper)
    assert estimate.project(mu, theta) == mu


@pytest.mark.parametrize("order", [1, 2, 3])
@given(st.data())
def test_p4_at_its_bounds_it_departs_from_the_rate_with_order_n_plus_one(order, data):
    """``P - mu ~ t^(n+1)`` at a depth t in the layer, so that n derivatives are continuous."""
    estimate = Estimate(0.0, -1.0, 1.0, margin=data.draw(between(0.1, 1.0)), order=order)
    mu = data.draw(log_between(0.1, 100.0))
    depth = estimate.epsilon * np.array([1e-2, 5e-3])
    departures = np.abs(mu - estimate.project(mu, 1.0 + depth))
    assert np.log2(departures[0] / departures[1]) == pytest.approx(order + 1, abs=0.05)


@given(moving(order=1))
def test_its_slopes_are_those_of_its_values(drawn):
    """Central differences; both slopes enter (46)."""
    estimate, mu, theta = drawn
    low, high = estimate.widened
    step = 1e-4 * estimate.epsilon
    assume(low + step < theta < high - step)
    for function, at, dx in (
        (lambda v: estimate.project(v, theta), mu, 1e-4 * abs(mu)),
        (lambda v: estimate.project(mu, v), theta, step),
    ):
        up, here, down = (function(at + k * dx) for k in (1, 0, -1))
        slope = jacobian(function, at)
        # beyond rounding, a difference is off by the curvature, which jumps at a bound
        rounding = 1e-9 * (abs(up) + abs(down) + abs(mu)) / dx
        curvature = abs(up - 2 * here + down) / dx
        assert slope == pytest.approx((up - down) / (2 * dx), rel=1e-4, abs=rounding + curvature)


@given(moving(order=1))
def test_its_slope_in_the_rate_lies_between_one_and_a_little_below_zero(drawn):
    estimate, mu, theta = drawn
    slope = jacobian(lambda v: estimate.project(v, theta), mu)
    reach = (estimate.half_width + estimate.epsilon) / estimate.half_width
    assert 1 - reach**2 - 1e-9 <= slope <= 1


# Many parameters, and expressions


@st.composite
def several(draw: st.DrawFn) -> tuple[list[Estimate], Estimate]:
    """Intervals one by one, and the same ones as one estimate of a vector."""
    margin, leak = draw(log_between(1e-2, 1.0)), draw(log_between(1e-6, 1.0))
    halves = draw(st.lists(log_between(1e-4, 1e6), min_size=2, max_size=5))
    single = [Estimate(h, 0.5 * h, 2.5 * h, margin, leak) for h in halves]
    fields = [tuple(getattr(e, name) for e in single) for name in ("initial", "lower", "upper")]
    return single, Estimate(*fields, margin, leak)


@given(st.data(), several())
def test_each_parameter_is_projected_and_clipped_by_itself(data, drawn):
    single, together = drawn
    theta = data.draw(within(together))
    mu = np.array([data.draw(between(-10.0, 10.0)) * e.half_width for e in single])
    apart = [e.project(m, t) for e, m, t in zip(single, mu, theta, strict=True)]
    np.testing.assert_allclose(together.project(mu, theta), apart, rtol=1e-10)
    far = 10 * theta
    apart = [e.clip(t) for e, t in zip(single, far, strict=True)]
    np.testing.assert_array_equal(together.clip(far), apart)


@given(moving(order=1))
def test_numbers_and_expressions_agree(drawn):
    estimate, mu, theta = drawn
    symbols = ca.SX.sym("mu"), ca.SX.sym("theta")
    outputs = {"P": estimate.project(*symbols), "clip": estimate.clip(symbols[1])}
    function = build("projection", {"mu": symbols[0], "theta": symbols[1]}, outputs)
    P, clipped = (float(v) for v in function(mu, theta))
    assert abs(P - estimate.project(mu, theta)) <= 1e-12 * (abs(P) + abs(mu))
    assert clipped == estimate.clip(theta)


# Sampled: the clip


@given(intervals(), between(-1e3, 1e3), between(0.0, 1.0))
def test_the_clip_holds_the_widened_interval_and_never_moves_away_from_the_truth(e, far, share):
    theta = centre(e) + far * e.half_width
    truth = e.lower + share * (e.upper - e.lower)
    clipped = e.clip(theta)
    low, high = e.widened
    assert low <= clipped <= high
    assert abs(truth - clipped) <= abs(truth - theta)
    assert clipped == theta or not low <= theta <= high


@given(moving(order=1))
def test_the_clip_rests_where_the_sample_is_short_against_the_slope(drawn):
    """An Euler step stays inside if ``T max |P_theta| <= 1``."""
    estimate, mu, _ = drawn
    low, high = estimate.widened
    grid = np.linspace(low, high, 400)
    values = estimate.project(np.full(400, mu), grid)
    steepest = np.abs(np.diff(values)).max() / (grid[1] - grid[0])
    step = 0.9 / max(steepest, abs(mu) / (high - low))
    ends = grid + step * values
    slack = 1e-9 * (high - low)
    inwards = (ends >= low - slack) & (ends <= high + slack)
    assert inwards.all()


def test_without_the_clip_a_step_of_the_experiments_size_leaves_the_interval():
    """A rate that crosses the layer in half a sample: nothing in continuous time forbids it."""
    estimate = Estimate(1.0, 0.5, 1.5)
    inside = estimate.upper
    step = 2 * estimate.epsilon
    assert inside + estimate.project(step, inside) > estimate.widened[1]
    assert estimate.clip(inside + estimate.project(step, inside)) == estimate.widened[1]


@given(between(-1e12, 1e12), between(-1e12, 1e12))
def test_a_law_clips_both_estimates_after_each_step(theta_dk_rate, theta_r_rate):
    law = told()
    rates = {
        "u_f": 0.0,
        "theta_dk_hat": theta_dk_rate,
        "theta_r_hat": theta_r_rate * np.linspace(-1.0, 1.0, 10),
    }
    following = law.step(law.initial_state(), rates, 5e-4)
    for name in ("theta_dk", "theta_r"):
        low, high = getattr(law, name).widened
        assert np.all(following[f"{name}_hat"] >= low)
        assert np.all(following[f"{name}_hat"] <= high)


# What is refused

BAD: dict[str, dict[str, object]] = {
    "inverted bounds": dict(initial=1.0, lower=2.0, upper=0.0),
    "empty interval": dict(initial=1.0, lower=1.0, upper=1.0),
    "one entry inverted": dict(initial=(1.0, 1.0), lower=(0.0, 2.0), upper=(2.0, 0.0)),
    "start below": dict(initial=-1.0, lower=0.0, upper=2.0),
    "start above": dict(initial=(1.0, 3.0), lower=(0.0, 0.0), upper=(2.0, 2.0)),
    "sizes": dict(initial=(1.0, 1.0), lower=(0.0, 0.0), upper=(2.0, 2.0, 2.0)),
    "number and vector": dict(initial=1.0, lower=(0.0,), upper=(2.0,)),
    "not a number": dict(initial=1.0, lower=float("nan"), upper=2.0),
    "infinite": dict(initial=1.0, lower=0.0, upper=float("inf")),
    "no margin": dict(initial=1.0, lower=0.0, upper=2.0, margin=0.0),
    "no leak": dict(initial=1.0, lower=0.0, upper=2.0, leak=0.0),
    "order 0": dict(initial=1.0, lower=0.0, upper=2.0, order=0),
    "unknown": dict(initial=1.0, lower=0.0, upper=2.0, epsilon=0.1),
    "text": dict(initial="one", lower=0.0, upper=2.0),
}


@pytest.mark.parametrize("fields", BAD.values(), ids=BAD)
def test_an_estimate_refuses(fields):
    with pytest.raises(InvalidParameters, match="Estimate"):
        Estimate(**fields)


def test_the_refusal_says_what_would_be_right():
    with pytest.raises(AlightError, match=r"lower = 2\.0 must lie below upper = 0\.0"):
        Estimate(1.0, 2.0, 0.0)
    with pytest.raises(AlightError, match=r"initial = 5\.0 must lie between"):
        Estimate(5.0, 0.0, 2.0)
