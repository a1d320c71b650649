"""The laws: what their feedback is bounded by, how they relate, what they know, when they stop."""

from __future__ import annotations

import dataclasses
from typing import Any

import casadi as ca
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from alight.control import (
    AdaptiveContactLaw,
    AdaptiveState,
    Estimate,
    ExactModel,
    ForceLimiting,
    Law,
    Measurement,
    Unsaturated,
)
from alight.control.transition import FILTER_TRIP
from alight.errors import AlightError, InvalidParameters
from alight.models import LinearSpring, PlantState
from alight.simulation.closed_loop import ClosedLoop, InitialState
from alight.simulation.run import run
from alight.symbolic.build import build
from alight.symbolic.derive import time_derivative
from alight.symbolic.signals import Layout
from alight.testbed import Testbed
from tests.control.cases import (
    EXPERIMENT_1,
    PLANT,
    STABLE,
    TARGET,
    Case,
    cases,
    changed,
    gains,
    laws,
    told,
)
from tests.control.closed_loop import evaluate, measured
from tests.strategies import between, plants, vectors

ADAPTIVE = pytest.mark.parametrize("cls", [ForceLimiting, Unsaturated])


# Feedback


@given(gains(), vectors(2, 1e6), vectors(2, 1e6))
def test_the_feedback_of_32_never_passes_one_plus_k3_on_any_axis(g, e_r, r_r):
    feedback = told(gains=g).feedback(e_r, r_r)
    assert (np.abs(feedback) <= 1 + np.array(g.k3)).all()


@given(gains(), st.sampled_from([-1.0, 1.0]))
def test_the_bound_of_the_feedback_is_reached(g, side):
    feedback = told(gains=g).feedback(side * np.full(2, 50.0), side * np.full(2, 50.0))
    np.testing.assert_allclose(feedback, side * (1 + np.array(g.k3)), rtol=1e-12)


@given(cases())
def test_the_feedforward_is_not_bounded_by_it(case):
    """What (32) limits is the feedback alone: all of the force beyond it is ``Y_r theta_r_hat``."""
    v = evaluate(case)
    limit = 1 + np.array(case.law.gains.k3)
    scale = np.abs(v["F"]) + np.abs(v["F_feedforward"])
    assert (np.abs(v["F"] - v["F_feedforward"]) <= limit + 1e-12 * scale).all()


@given(gains(), vectors(2, 1.0), vectors(2, 1.0))
def test_44_is_the_first_order_of_32(g, e_r, r_r):
    """``x - tanh(x)`` lies between 0 and ``x^3 / 3``."""
    saturated = told(gains=g).feedback(e_r, r_r)
    linear = told(gains=g, cls=Unsaturated).feedback(e_r, r_r)
    k3 = np.array(g.k3)
    third_order = (np.abs(e_r) ** 3 + k3 * np.abs(r_r) ** 3) / 3
    assert (np.abs(linear - saturated) <= third_order + 1e-14 * (1 + k3)).all()


@given(cases())
def test_32_and_44_differ_in_nothing_but_their_feedback(case):
    other = Unsaturated(**{f.name: getattr(case.law, f.name) for f in dataclasses.fields(case.law)})
    v, w = evaluate(case), evaluate(dataclasses.replace(case, law=other))
    for name in ("F_feedforward", "Y_r", "theta_r_hat_dot", "theta_dk_hat_dot", "u_f_dot"):
        np.testing.assert_array_equal(v[name], w[name], err_msg=name)


# Exact model knowledge


@given(cases(Unsaturated))
def test_exact_model_is_44_with_the_true_parameters_and_adaptation_off(case):
    law = changed(case.law, Gamma=1e-200)
    truth = np.array(law.theta_r_of(law.pi_of(law.model)))
    a = AdaptiveState(case.a.u_f, law.model.theta_dk, truth)
    adaptive = evaluate(Case(law, case.s, case.e_f, a))
    exact = ExactModel(model=law.model, target=law.target, gains=law.gains, e_f=law.e_f)
    flow = exact.flow({"u_f": case.a.u_f}, measured(case.s))
    scale = np.abs(adaptive["Y_r"]) @ np.abs(truth)
    assert (np.abs(flow.signals["F"] - adaptive["F"]) <= 1e-10 * scale).all()
    assert flow.rates["u_f"] == pytest.approx(adaptive["u_f_dot"], rel=1e-9, abs=1e-9)


@given(cases())
def test_exact_model_linearises_the_loop(case):
    """``M_bar r_r_dot = -C_bar r_r - e_r - k3 r_r``: nothing of the parameters is left over."""
    law, plant, s = case.law, case.law.model, case.s
    exact = ExactModel(model=plant, target=law.target, gains=law.gains)

    def flow(q: Any, q_dot: Any, x_m: Any, x_m_dot: Any, u_f: Any) -> Any:
        return exact.flow({"u_f": u_f}, Measurement(q, q_dot, x_m, x_m_dot))

    at = [*s[:4], case.a.u_f]
    now = flow(*at)
    moving = plant.rates(s, now.tau)
    r_r_dot = time_derivative(
        lambda *x: flow(*x).signals["r_r"], at, [*moving[:4], now.rates["u_f"]], constants=exact
    )
    e_r, r_r, k3 = now.signals["e_r"], now.signals["r_r"], np.array(law.gains.k3)
    M, C = plant.arm.M_bar(s.q), plant.arm.C_bar(s.q, s.q_dot)
    parts = [M @ r_r_dot, C @ r_r, e_r, k3 * r_r]
    scale = np.abs(now.signals["F_feedforward"]).max() + sum(np.abs(p).max() for p in parts)
    np.testing.assert_allclose(sum(parts), 0.0, atol=1e-9 * scale)


def test_exact_model_needs_no_estimates_and_holds_only_the_filter():
    law = ExactModel(model=PLANT, target=TARGET, gains=STABLE, e_f=0.3)
    assert set(law.states) == {"u_f"}
    assert law.initial_state() == {"u_f": pytest.approx(np.tanh(0.3))}


# What a law knows


EVERY_LAW = pytest.mark.parametrize(
    "law",
    [told(), told(cls=Unsaturated), ExactModel(model=PLANT, target=TARGET, gains=STABLE)],
    ids=lambda law: type(law).__name__,
)


def symbolic_tick(law: Law) -> ca.Function:
    """A tick with every argument free but the parameters; `build` refuses any other symbol."""
    seen = {
        name: ca.SX.sym(f"see_{name}", signal.size)
        for name, signal in Layout.of(Measurement).signals.items()
    }
    memory = {name: ca.SX.sym(f"hold_{name}", s.size) for name, s in law.states.items()}
    dt = ca.SX.sym("dt")
    tick = law.tick(memory, Measurement(**seen), dt)
    inputs = {f"see_{n}": v for n, v in seen.items()} | {f"hold_{n}": v for n, v in memory.items()}
    outputs = {"tau": tick.tau, "trip": tick.trip} | {f"next_{n}": v for n, v in tick.state.items()}
    return build("tick", {**inputs, "dt": dt}, outputs)


@EVERY_LAW
def test_a_tick_is_a_function_of_positions_velocities_and_memory_alone(law):  # Assumption 3
    function = symbolic_tick(law)
    seen = [name for name in function.name_in() if name.startswith("see_")]
    assert seen == ["see_q", "see_q_dot", "see_x_m", "see_x_m_dot"]


@EVERY_LAW
def test_numbers_and_expressions_give_the_same_tick(law):
    seen = Measurement(np.array([1.1, -1.3]), np.array([0.4, -0.2]), 0.21, 0.05)
    state = law.initial_state()
    numeric = law.tick(state, seen, 5e-4)
    tau, trip, *following = (
        v.full() for v in symbolic_tick(law).call([*seen, *state.values(), 5e-4])
    )
    np.testing.assert_allclose(tau[:, 0], numeric.tau, rtol=1e-9)
    assert trip == numeric.trip == 0
    for found, name in zip(following, law.states, strict=True):
        np.testing.assert_allclose(found.ravel(), np.ravel(numeric.state[name]), rtol=1e-9)


@given(plants(st.just(LinearSpring(K_I=3e4)), friction=True))
def test_an_adaptive_law_reads_only_link_lengths_and_rest_position_of_its_model(other):
    """Inertia, masses, stiffness and friction of what it is told change nothing it does."""
    arm = dataclasses.replace(other.arm, l1=PLANT.arm.l1, l2=PLANT.arm.l2)
    body = dataclasses.replace(other.body, x_0=PLANT.body.x_0)
    law = told()
    liar = dataclasses.replace(law, model=dataclasses.replace(other, arm=arm, body=body))
    seen = Measurement(np.array([1.1, -1.3]), np.array([0.4, -0.2]), 0.21, 0.05)
    first, second = (symbolic.flow(law.initial_state(), seen) for symbolic in (law, liar))
    np.testing.assert_array_equal(first.tau, second.tau)
    for name in law.states:
        np.testing.assert_array_equal(first.rates[name], second.rates[name])


# Start, and the domain of the filter


@given(laws())
def test_the_state_at_the_start(law):
    state = law.initial_state()
    assert set(state) == set(law.states)
    assert state["u_f"] == np.tanh(law.e_f)
    assert state["theta_dk_hat"] == law.theta_dk.initial
    np.testing.assert_array_equal(state["theta_r_hat"], law.theta_r.initial)


@given(between(-0.9999, 0.9999), between(-3.0, 3.0))
def test_a_law_trips_exactly_when_its_filter_leaves_the_open_unit_interval(u_f, x_m_dot):
    law = told(gains=EXPERIMENT_1)
    state = {**law.initial_state(), "u_f": u_f}
    seen = Measurement(np.array([1.1, -1.3]), np.zeros(2), 0.21, x_m_dot)
    tick = law.tick(state, seen, 0.1)
    assume(abs(abs(tick.state["u_f"]) - 1) > 1e-9)
    left = abs(tick.state["u_f"]) > 1
    assert tick.trip == (FILTER_TRIP if left else 0)
    assert FILTER_TRIP in law.trips


def test_a_mass_that_leaves_fast_trips_the_filter_and_one_at_rest_does_not():
    law = told(gains=EXPERIMENT_1)
    seen = Measurement(np.array([1.1, -1.3]), np.zeros(2), 0.21, 0.0)
    assert law.tick(law.initial_state(), seen, 0.1).trip == 0
    assert law.tick(law.initial_state(), seen._replace(x_m_dot=-9.0), 0.1).trip == FILTER_TRIP


@given(gains(), between(-0.6, 0.6), between(-20.0, 20.0))
def test_the_filter_turns_back_where_the_mass_is_slow_enough(g, e_m, x_m_dot):
    """``|u_f| < 1`` is invariant if ``|alpha1 tanh(e_m) - x_m_dot| < alpha2``: at 1, u_f falls."""
    assume(abs(g.alpha1 * np.tanh(e_m) - x_m_dot) < 0.999 * g.alpha2)
    law = told(gains=g)
    for side in (-1.0, 1.0):
        _, u_f_dot, _ = law.filter_rates(TARGET.x_md - e_m, x_m_dot, side, PLANT.theta_dk)
        assert side * u_f_dot < 0


# Gravity


@given(cases(plane="vertical"))
def test_in_a_vertical_plane_twelve_parameters_carry_the_true_required_force(case):
    """Holding still takes gravity; moving takes what the plant itself shows."""
    law, plant, s = case.law, case.law.model, case.s
    v = evaluate(case)
    assert len(law.Gamma_r) == v["theta_r"].size == v["Y_r"].shape[1] == 12
    tau = np.array([3.0, -1.0])
    q_ddot = plant.rates(s, tau).q_dot
    x_r_ddot = v["J"] @ q_ddot + v["J_dot"] @ s.q_dot
    F = np.linalg.solve(v["J"].T, tau)
    alpha = np.array(law.gains.alpha)
    r_r_dot = np.array([v["x_rd1_ddot"], 0.0]) + alpha * v["e_r_dot"] - x_r_ddot
    needed = v["M_bar"] @ r_r_dot + v["C_bar"] @ v["r_r"] + F
    scale = sum(np.abs(p).max() for p in (v["M_bar"] @ r_r_dot, v["M_bar"] @ x_r_ddot, F, v["W"]))
    np.testing.assert_allclose(v["W"], needed, rtol=0, atol=1e-9 * scale)


@given(cases(plane="vertical"))
def test_gravity_stands_in_the_last_two_columns(case):
    v = evaluate(case)
    weights = np.array([case.law.model.arm.g1, case.law.model.arm.g2])
    scale = np.abs(v["h_bar"]).max() + np.linalg.norm(weights) / np.linalg.norm(v["J"])
    np.testing.assert_allclose(v["Y_r"][:, 10:] @ weights, v["h_bar"], rtol=0, atol=1e-10 * scale)


@ADAPTIVE
def test_an_arm_in_a_vertical_plane_runs_under_an_adaptive_law(cls):
    arm = dataclasses.replace(PLANT.arm, plane="vertical", g1=30.0, g2=8.0)
    plant = dataclasses.replace(PLANT, arm=arm)
    law = told(plant, cls=cls)
    assert Layout(law.states).size == 14
    q = arm.inverse((0.06, 0.436), "-")
    start = InitialState(q=(float(q[0]), float(q[1])), x_m=0.206)
    recording = run(ClosedLoop(plant, Testbed(), law), start, 0.01, backend="vm")
    assert recording.verdict.completed
    assert recording["theta_r_hat"].shape == (20, 12)


# What is refused


@ADAPTIVE
@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"Gamma_r": (1.0,) * 9}, "Gamma_r needs 10 entries"),
        ({"Gamma_r": (0.0,) * 10}, "greater than 0"),
        ({"theta_r": Estimate((1.0,) * 12, (0.0,) * 12, (2.0,) * 12)}, "needs 10 entries"),
        ({"theta_r": Estimate(1.0, 0.0, 2.0)}, "needs 10 entries"),
        ({"theta_dk": Estimate((0.1,), (0.0,), (0.2,))}, "theta_dk.initial must be one number"),
        ({"e_f": float("nan")}, "finite"),
        ({"speeed": 1.0}, "unknown name"),
    ],
    ids=str,
)
def test_an_adaptive_law_refuses(cls, changes, message):
    with pytest.raises(InvalidParameters, match=message):
        told(cls=cls, **changes)


@pytest.mark.parametrize("name", ["k1", "k2", "alpha1", "alpha2", "alpha3", "Gamma"])
@pytest.mark.parametrize("value", [0.0, -1.0, float("inf"), float("nan")])
def test_gains_are_positive_numbers(name, value):
    with pytest.raises(AlightError, match=name):
        dataclasses.replace(STABLE, **{name: value})


@pytest.mark.parametrize("name", ["k3", "alpha"])
@pytest.mark.parametrize("value", [(1.0,), (1.0, 0.0), (1.0, -1.0), 1.0, (1.0, 1.0, 1.0)])
def test_diagonal_gains_are_two_positive_numbers(name, value):
    with pytest.raises(AlightError, match=name):
        dataclasses.replace(STABLE, **{name: value})


def test_only_a_law_with_a_feedback_is_a_law():
    with pytest.raises(TypeError, match="feedback"):
        AdaptiveContactLaw(model=PLANT, target=TARGET, gains=STABLE)


def test_at_rest_on_target_with_true_parameters_nothing_moves():
    """The equilibrium of every law: zero rates, and the torque that holds the compressed spring."""
    truth = np.array(told().theta_r_of(told().pi_of(PLANT)))
    held = PLANT.body.k_s * (TARGET.x_md - PLANT.body.x_0)
    tip = (TARGET.x_md + held / PLANT.contact.K_I, TARGET.x_rd2)
    s = PlantState(PLANT.arm.inverse(tip, "-"), np.zeros(2), TARGET.x_md, 0.0, 0.0)
    exact = ExactModel(model=PLANT, target=TARGET, gains=STABLE)
    known = {"u_f": 0.0, "theta_dk_hat": PLANT.theta_dk, "theta_r_hat": truth}
    for law in (told(), told(cls=Unsaturated), exact):
        flow = law.flow({name: known[name] for name in law.states}, measured(s))
        np.testing.assert_allclose(flow.signals["F"], [held, 0.0], atol=1e-9)
        for rate in (*flow.rates.values(), *PLANT.rates(s, flow.tau)):
            np.testing.assert_allclose(rate, 0.0, atol=1e-8)
