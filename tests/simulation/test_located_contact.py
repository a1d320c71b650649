"""Steps that end where contact begins or ends: order, instants, and what must not change."""

from __future__ import annotations

import functools
from typing import Any

import casadi as ca
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from alight.kernels.direct import Direct
from alight.models import (
    HuntCrossley,
    KelvinVoigt,
    LinearSpring,
    MassSpring,
    Plant,
    PlantState,
    TipFriction,
)
from alight.simulation.closed_loop import PLANT, ClosedLoop, advance, phases_of
from alight.simulation.integrate import Phases
from alight.symbolic.build import build
from alight.symbolic.parameters import lift, rebind, values_of
from alight.testbed import Testbed
from tests.simulation.classical import classical_step
from tests.simulation.striking import ARM, Exact, Known, Strike, column_of, known_strikes, state_of
from tests.strategies import CONTACT_LAWS, between, log_between, plant_states, plants, vectors
from tests.testbed.laws import Steady

LAWS = pytest.mark.parametrize("law", list(CONTACT_LAWS), ids=lambda law: law.__name__)
RESOLVED = np.array([12, 24, 48])
"""Steps in half a period of the contact; at 2 kHz the experiments have about 25."""
MEASURED = {LinearSpring: 5.0, KelvinVoigt: 5.2, HuntCrossley: 5.5}
"""Mean order over random strikes."""


@functools.cache
def samplers(law: type) -> tuple[Direct, Direct]:
    """The plant a sample later: by one located step, and by four classical ones over any switch."""
    lifted, rate = lift(Plant(ARM, MassSpring(1.0, 1.0, 0.0), law())), ca.SX.sym("rate")
    x, tau = ca.SX.sym("x", PLANT.size), ca.SX.sym("tau", 2)
    loop = ClosedLoop(lifted.obj, rebind(Testbed(), sample_rate=rate), Steady((0.0, 0.0)), 1)
    inputs = {"p": lifted.symbols, "x": x, "tau": tau, "rate": rate}

    def rates(at: ca.SX) -> ca.SX:
        return column_of(lifted.obj.rates(state_of(at), tau))

    unlocated = x
    for _ in range(4):
        unlocated = classical_step(rates, unlocated, 1 / rate / 4)
    located = column_of(advance(loop, state_of(x), tau))
    return (
        Direct(build("located", inputs, {"following": located})),
        Direct(build("unlocated", inputs, {"following": unlocated})),
    )


def sampled(step: Direct, known: Known, steps: int) -> float:
    """Error at the end of a strike that is run in so many samples."""
    p, x, rate = values_of(known.hit.plant), known.hit.start, steps / known.duration
    for _ in range(steps):
        x = step(p, x, known.hit.tau, rate)[0]
    return float(np.abs(x - known.end).max())


# Order


@LAWS
def test_the_sampled_plant_converges_with_order_5_through_touch_and_separation(law):
    """One located step in a sample, and less error than four classical steps that see no switch."""
    located, unlocated = samplers(law)
    orders, ratios = [], []
    for known in known_strikes(law, 12):
        steps = [int(np.ceil(n * known.duration / known.hit.half_period)) for n in RESOLVED]
        errors = [sampled(located, known, n) for n in steps]
        orders.append(-np.polyfit(np.log(steps), np.log(errors), 1)[0])
        ratios.append(errors[1] / sampled(unlocated, known, steps[1]))
    assert np.mean(orders) == pytest.approx(MEASURED[law], abs=0.1)
    assert np.mean(orders) >= 4.5
    assert np.median(ratios) < 0.1


def test_a_force_without_curvature_at_the_touch_costs_order_there():
    """A sphere's: the second slope of gap^1.5 is infinite at first touch, split there or not."""
    located, _ = samplers(HuntCrossley)
    resolved, errors = np.array([12, 192]), []
    for known in known_strikes(HuntCrossley, 6):
        tip = HuntCrossley(K_I=30 * known.hit.plant.contact.K_I, exponent=1.5, dissipation=0.3)
        hit = Strike(rebind(known.hit.plant, contact=tip), known.hit.start, known.hit.tau)
        end, _ = Exact(hit).until(known.duration)
        ends = known._replace(hit=hit, end=end)
        steps = [int(np.ceil(n * known.duration / known.hit.half_period)) for n in resolved]
        errors.append([sampled(located, ends, n) for n in steps])
    coarse, fine = np.median(errors, axis=0)
    assert 2.0 < np.log(coarse / fine) / np.log(resolved[1] / resolved[0]) < 4.0


# The instant


def split_of(hit: Strike, x: np.ndarray, dt: float) -> tuple[float, float, np.ndarray]:
    """Guard where a step splits, what it changes by over the step, and the state after."""
    phases = phases_of(hit.plant, hit.tau)
    first, met = phases.phase(x), []

    def rates(at: Any, phase: Any) -> Any:
        if phase != first:
            met.append(at)
        return phases.rates(at, phase)

    following = Phases(rates, phases.guard).split_step(x, dt)
    return abs(phases.guard(met[0])), abs(phases.guard(following) - phases.guard(x)), following


@LAWS
def test_the_step_splits_where_the_guard_vanishes_to_the_order_of_the_step(law):
    """The first state that is followed in the other phase lies on the surface."""
    rng = np.random.default_rng(0)
    orders = []
    for known in known_strikes(law, 6, seed=1):
        share, found = rng.uniform(0.1, 0.9), []
        for dt in (known.touch, known.touch / 4):
            x, _ = known.exact.until(known.touch - share * dt)
            found.append(split_of(known.hit, x, dt)[:2])
        (coarse, span), (fine, _) = found
        assert coarse < 1e-8 * span
        if fine > 1e-13 * span:  # else rounding is all that is left
            orders.append(np.log(coarse / fine) / np.log(4))
    assert np.mean(orders or [np.inf]) > 4


@pytest.mark.parametrize(
    "contact",
    [KelvinVoigt(K_I=2e4, damping=40.0), HuntCrossley(K_I=2e4, dissipation=2.0)],
    ids=lambda contact: type(contact).__name__,
)
@given(speed=between(0.491, 0.499))
def test_a_contact_that_lets_go_before_the_gap_opens_is_split_there(contact, speed):
    """A mass that is pulled off at 20 m/s^2, and soon faster than the contact follows: 0.5 m/s."""
    q, gap, dt = ARM.inverse((0.2, 0.4), "-"), 1e-3, 5e-4
    body = MassSpring(1.5, 600.0, 0.2 - gap + 1.5 * 20.0 / 600.0)
    x = column_of(PlantState(q, np.zeros(2), 0.2 - gap, speed, 0.0))
    hit = Strike(Plant(ARM, body, contact), x, np.zeros(2))
    expected, switches = Exact(hit).until(dt, closed=True)
    assume(len(switches) == 1)
    guard, span, following = split_of(hit, x, dt)
    assert guard < 1e-8 * span
    assert hit.plant.touch(state_of(following)).gap > 0
    np.testing.assert_allclose(following, expected, rtol=0, atol=1e-10)


# What must not change


@functools.cache
def both_steps(law: type) -> Direct:
    """A step split where it must be, the same step not split, and whether it met a switch."""
    lifted = lift(Plant(ARM, MassSpring(1.0, 1.0, 0.0), law()))
    x, tau, dt = ca.SX.sym("x", PLANT.size), ca.SX.sym("tau", 2), ca.SX.sym("dt")
    phases = phases_of(lifted.obj, tau)
    following, switched = phases.step(x, dt)
    outputs = {"split": phases.split_step(x, dt), "following": following, "switched": switched}
    return Direct(build("both", {"p": lifted.symbols, "x": x, "tau": tau, "dt": dt}, outputs))


@LAWS
@given(st.data(), vectors(2, 50.0), log_between(1e-5, 1e-3))
def test_a_step_without_a_switch_has_the_same_bits_split_or_not(law, data, tau, dt):
    plant = data.draw(plants(CONTACT_LAWS[law]()))
    s = data.draw(plant_states(plant))
    split, following, switched = both_steps(law)(values_of(plant), column_of(s), tau, dt)
    touch, after = plant.touch(s), plant.touch(state_of(following))
    assert switched[0] == float((touch.guard >= 0) != (after.guard >= 0))
    if not switched[0]:
        np.testing.assert_array_equal(split, following)
    assert np.isfinite(split).all()


@LAWS
def test_a_step_with_a_switch_is_another(law):
    """The share of the touch in the step decides by how much."""
    for known in known_strikes(law, 3, seed=2):
        x, _ = known.exact.until(0.5 * known.touch)
        arguments = (values_of(known.hit.plant), x, known.hit.tau, known.touch)
        split, following, switched = both_steps(law)(*arguments)
        assert switched[0] == 1 and np.abs(split - following).max() > 0


# On the surface


def on_the_surface(law: type, gap_dot: float, **damping: float) -> Strike:
    """A tip that touches the mass to the last bit, and leaves or enters it."""
    q = ARM.inverse((0.2, 0.4), "-")
    q_dot = np.linalg.solve(ARM.J(q), [gap_dot, 0.3])
    x_m = float(ARM.x_r(q)[0])
    plant = Plant(ARM, MassSpring(1.5, 600.0, x_m), law(K_I=2e4, **damping))
    return Strike(plant, column_of(PlantState(q, q_dot, x_m, 0.0, 0.0)), np.zeros(2))


@pytest.mark.parametrize(
    ("law", "damping"),
    [(LinearSpring, {}), (KelvinVoigt, {"damping": 40.0}), (HuntCrossley, {"dissipation": 0.5})],
    ids=lambda value: getattr(value, "__name__", ""),
)
@given(side=st.sampled_from([-1.0, 1.0]), speed=log_between(1e-6, 1.0), dt=log_between(1e-5, 1e-3))
def test_a_start_exactly_on_the_surface_goes_the_way_it_moves(law, damping, side, speed, dt):
    hit = on_the_surface(law, side * speed, **damping)
    assert hit.plant.touch(state_of(hit.start)).gap == 0
    found = samplers(law)[0](values_of(hit.plant), hit.start, hit.tau, 1 / dt)[0]
    closed = side > 0
    expected, switches = Exact(hit).until(dt, closed=closed)
    assume(not switches)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6 * speed + 1e-12)
    assert (hit.plant.touch(state_of(found)).gap > 0) == closed


@LAWS
@pytest.mark.parametrize("deeper", [-1e-3, -1e-6, -1e-12, 0.0, 1e-12, 1e-6, 1e-3])
@given(offset=between(0.0, 1.0))
def test_a_contact_that_only_grazes_leaves_the_motion_as_it_was(law, deeper, offset):
    """The mass swings away as the tip comes: at the turning point the gap is about zero.

    A penetration of that size gives the mass no more than some 1e-6 m/s, found or overlooked.
    """
    away, speed, dt = 20.0, 0.05, 5e-4  # [m/s^2], [m/s], [s]
    short = speed**2 / (2 * away) * (1 - deeper)
    q = ARM.inverse((0.2, 0.4), "-")
    body = MassSpring(1.5, 600.0, 0.2 + short + 1.5 * away / 600.0)
    x = column_of(PlantState(q, np.zeros(2), 0.2 + short, -speed, 0.0))
    free = Plant(ARM, body, LinearSpring(K_I=1e-9))
    touching = Plant(ARM, body, law(K_I=2e4))
    first = offset * dt + 1e-6
    located = samplers(law)[0]
    columns = []
    for plant, step in ((touching, located), (free, samplers(LinearSpring)[0])):
        at = step(values_of(plant), x, np.zeros(2), 1 / first)[0]
        for _ in range(10):
            at = step(values_of(plant), at, np.zeros(2), 1 / dt)[0]
        columns.append(at)
    np.testing.assert_allclose(columns[0], columns[1], rtol=0, atol=2e-6)


def test_a_bristle_rests_without_friction_and_follows_with_it():
    hit = on_the_surface(LinearSpring, 0.1)
    s = state_of(hit.start)._replace(z=1e-5)
    for mu, moves in ((0.0, False), (0.3, True)):
        plant = rebind(hit.plant, tip_friction=TipFriction(mu=mu))
        for pressing in (None, 0.0, 1.0):
            assert (plant.rates(s, np.zeros(2), pressing).z != 0) == moves
