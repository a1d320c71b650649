"""Proposition C: the filter before contact, and the time by which contact has come."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
import pytest
from hypothesis import assume, given, settings
from numpy import tanh
from scipy.integrate import solve_ivp

import alight
from alight.control import ForceLimiting, Gains, Unsaturated
from alight.models import MassSpring
from alight.simulation.closed_loop import ClosedLoop, InitialState
from alight.theory.case import Case, case_of
from alight.theory.proven import FirstContact, first_contact, first_contact_of, lead
from alight.theory.proven.first_contact import resting_filter_rate
from alight.theory.proven.robot_part import RobotBounds, damping, holding, robot_bounds_of
from tests.control.cases import EXPERIMENT_1, PLANT, TARGET, gains, told
from tests.strategies import between
from tests.theory.test_decrease import STRONG


def resting(g: Gains, d: float, cls: type = ForceLimiting, e_f: float = 0.0) -> ForceLimiting:
    """A law whose mass rests ``d`` before its target."""
    body = MassSpring(PLANT.body.m, PLANT.body.k_s, TARGET.x_md - d)
    return told(dataclasses.replace(PLANT, body=body), g, cls, e_f=e_f)


def at_rest(law: ForceLimiting, gap: float = -0.05, elbow: str = "-") -> tuple:
    """Tip before the body, everything at rest."""
    body = law.model.body
    q = law.model.arm.inverse((body.x_0 + gap, 0.4), elbow)
    s = alight.models.PlantState(q, np.zeros(2), body.x_0, 0.0, 0.0)
    return s, alight.control.AdaptiveState(**law.initial_state())


def bounded(law: ForceLimiting, **start) -> tuple[FirstContact, RobotBounds]:
    s, a = at_rest(law, **start)
    robot = robot_bounds_of(law.model, law, s, a)
    return first_contact_of(law, s, a, robot), robot


# The filter before contact


@settings(max_examples=25)
@given(gains(), between(0.005, 0.1))
def test_the_filter_has_one_rest_in_its_domain_and_the_lead_there_is_positive(g, d):
    w = tanh(d)
    assume(g.alpha1 * w < 0.999 * g.alpha2)
    found, _ = bounded(resting(g, d))
    cubic = [g.alpha3, -g.alpha2 * w, -g.alpha3 - g.k1 * g.alpha2, w * (g.alpha2 - g.k1 * g.alpha1)]
    roots = np.roots(cubic)
    inside = [root.real for root in roots if abs(root) < 1]
    assert len(inside) == 1
    assert found.u_inf == pytest.approx(inside[0], abs=1e-9)
    u = found.u_inf
    second_form = g.alpha3 * u / g.alpha2 + g.k1 * g.alpha1 * w / (g.alpha2 * (1 - u**2))
    assert found.s_inf == pytest.approx(g.k2 * second_form, rel=1e-6)
    assert found.s_inf > 0


def test_the_lead_is_positive_for_twenty_thousand_gains():
    """In both its forms, the roots by Newton's method from the middle of each sign change."""
    rng = np.random.default_rng(6)
    low, high = np.log([0.01, 0.1, 0.1, 1e-4, 1e-3]), np.log([50.0, 1e3, 1e3, 1e3, 3.0])
    k1, alpha1, alpha2, alpha3, d = np.exp(rng.uniform(low, high, (40_000, 5))).T
    w = tanh(d)
    kept = alpha1 * w < alpha2
    k1, alpha1, alpha2, alpha3, w = (v[kept] for v in (k1, alpha1, alpha2, alpha3, w))
    assert kept.sum() >= 20_000
    below, above = -np.ones(len(w)), np.ones(len(w))
    for _ in range(70):
        u = (below + above) / 2
        rising = (1 - u**2) * (alpha2 * w - alpha3 * u) - k1 * (alpha1 * w + alpha2 * u) > 0
        below, above = np.where(rising, u, below), np.where(rising, above, u)
    assert (w - k1 * u / (1 - u**2) > -1e-9 * (w + k1)).all()
    assert (np.where(u > 0, alpha3 * u, 0) + k1 * alpha1 * w / (1 - u**2) > 0).all()


@pytest.mark.parametrize("e_f", [-1.0, 0.0, 1.5])
@pytest.mark.parametrize("g", [EXPERIMENT_1, dataclasses.replace(EXPERIMENT_1, alpha3=8.0, k1=0.2)])
def test_the_filter_tends_to_its_rest_without_passing_it(g, e_f):
    law = resting(g, 0.03, e_f=e_f)
    found, _ = bounded(law)
    path = solve_ivp(
        lambda _, u: [resting_filter_rate(law, u[0])],
        (0.0, 30.0),
        [tanh(e_f)],
        rtol=1e-10,
        atol=1e-12,
    ).y[0]
    assert path[-1] == pytest.approx(found.u_inf, abs=1e-6)
    side = np.sign(path[0] - found.u_inf)
    assert (side * np.diff(path) <= 1e-9).all()


def test_experiment_1_has_the_rest_and_the_lead_that_the_audit_found():
    found, _ = bounded(resting(EXPERIMENT_1, 0.03))
    assert found.u_inf == pytest.approx(-0.0948, abs=5e-5)
    assert found.s_inf == pytest.approx(0.1040, abs=5e-5)


# By when contact has come


def owed(law: ForceLimiting, u_f: np.ndarray, t: np.ndarray, e: np.ndarray) -> float:
    """What V_r must have fallen by along a tip error ``e(t)`` on axis 1 [J]."""
    alpha_1 = law.gains.alpha[0]
    r = np.gradient(e, t, edge_order=2) + alpha_1 * e
    damped = np.array([v * damping(law, 0, v) for v in r])
    held = np.array([v * holding(law, v) for v in e])
    return float(np.trapezoid(damped + alpha_1 * held, t))


def cheapest_paths(law: ForceLimiting, latest: float, e_r1: float) -> list[np.ndarray]:
    """Tip errors above the lead from the start on, several of which are close to the cheapest."""
    t = np.linspace(0.0, latest, 3001)
    u = solve_ivp(
        lambda _, u: [resting_filter_rate(law, u[0])],
        (0.0, latest),
        [tanh(law.e_f)],
        t_eval=t,
        rtol=1e-9,
        atol=1e-12,
    ).y[0]
    s = np.array([lead(law, v) for v in u])
    paths = []
    for fade in (1.0, 3.0):
        for rest in (0.0, 0.1):
            gone = np.exp(-fade * law.gains.alpha[0] * t)
            paths.append(np.maximum(s + (e_r1 - s[0]) * gone + rest * np.abs(s) * (1 - gone), s))
    return [t, u, *paths]


@pytest.mark.parametrize("cls", [ForceLimiting, Unsaturated])
@pytest.mark.parametrize("changes", [{}, {"alpha1": 10.0, "alpha3": 1.0}, {"k1": 0.3}], ids=str)
def test_no_way_of_staying_away_any_longer_is_paid_for(cls, changes):
    """Every error that keeps above the lead costs R by then; the cheapest little more than R."""
    law = resting(dataclasses.replace(EXPERIMENT_1, **changes), 0.03, cls)
    found, robot = bounded(law)
    e_r1 = robot.e_r_start[0]
    t, u, *paths = cheapest_paths(law, found.latest, e_r1)
    costs = [owed(law, u, t, e) for e in paths]
    assert min(costs) >= robot.R * (1 - 1e-3)
    assert min(costs) <= 1.5 * robot.R


@pytest.mark.parametrize("elbow", ["+", "-"])
@pytest.mark.parametrize("cls", [ForceLimiting, Unsaturated])
@pytest.mark.parametrize("gap", [-0.1, -0.02])
def test_runs_touch_before_the_bound(elbow, cls, gap):
    law = resting(dataclasses.replace(EXPERIMENT_1, alpha1=20.0, alpha=(20.0, 10.0)), 0.03, cls)
    found, _ = bounded(law, gap=gap, elbow=elbow)
    s, _ = at_rest(law, gap, elbow)
    start = InitialState(q=(float(s.q[0]), float(s.q[1])), x_m=float(s.x_m))
    times = np.linspace(0.0, min(found.latest, 3.0), 50)
    run = alight.reference(ClosedLoop(law.model, STRONG, law), start, times)
    assert len(run.switches) > 0
    assert 0 < run.switches[0] <= found.latest


@functools.cache
def shipped(name: str) -> Case:
    return case_of(alight.load_scenario(name))


@pytest.mark.parametrize(("name", "latest"), [("experiment-1", 1.2), ("experiment-2", 12.0)])
def test_the_bound_over_all_boxes_is_seconds_for_the_experiments(name, latest):
    """The position alone would leave 932 s and 45 h."""
    found = first_contact(shipped(name))
    assert 0.1 < found.latest < latest


def test_more_knowledge_of_the_plant_brings_the_bound_forward():
    case = shipped("experiment-1")
    known = robot_bounds_of(case.plant, case.law, case.s, case.a)
    assert first_contact_of(case.law, case.s, case.a, known).latest < first_contact(case).latest


# Where there is none


@pytest.mark.parametrize(
    ("change", "word"),
    [
        (lambda c: dataclasses.replace(c, s=c.s._replace(x_m_dot=0.01)), "at rest"),
        (lambda c: dataclasses.replace(c, s=c.s._replace(x_m=0.21)), "at rest"),
        (
            lambda c: dataclasses.replace(
                c, law=dataclasses.replace(c.law, target=alight.Target(0.2, 0.358))
            ),
            "beyond",
        ),
        (
            lambda c: dataclasses.replace(
                c,
                law=dataclasses.replace(
                    c.law, gains=dataclasses.replace(EXPERIMENT_1, alpha1=1000.0)
                ),
            ),
            "reach 1",
        ),
    ],
    ids=["moving", "displaced", "target before the mass", "filter"],
)
def test_it_says_why_there_is_no_bound(change, word):
    found = first_contact(change(shipped("experiment-1")))
    assert found.latest is None
    assert word in found.undefined


@pytest.mark.parametrize("depth", [0.0, 1e-3])
def test_a_tip_that_touches_at_the_start_has_touched(depth):
    found, _ = bounded(resting(EXPERIMENT_1, 0.03), gap=depth)
    assert found.latest == 0.0
