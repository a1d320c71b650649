"""Random runs of the continuous loop, tightly integrated: what every proven bound is held against.

They are short and their gains moderate, so that the loop is resolved. A run is cut where the arm
comes near a singular pose, in which ``M_bar`` has no bound and Remark 1 of the paper no longer
holds; where the filter escapes; and where no solver could follow it in a second.
"""

from __future__ import annotations

import dataclasses
import functools
import itertools
import warnings
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from scipy.integrate import solve_ivp

import alight
from alight.control import (
    AdaptiveContactLaw,
    AdaptiveState,
    Estimate,
    ForceLimiting,
    Gains,
    Target,
    Unsaturated,
)
from alight.kernels.direct import Direct
from alight.models import LinearSpring, MassSpring, Plant, PlantState, TwoLinkArm
from alight.scenarios.assumptions import Assumptions
from alight.simulation import Recording
from alight.simulation.closed_loop import PLANT, ClosedLoop, InitialState
from alight.simulation.continuous import continuous_rates, join_state
from alight.simulation.reference import state_size
from alight.symbolic.build import build
from alight.symbolic.ops import determinant
from alight.symbolic.parameters import lift, values_of
from alight.symbolic.signals import Layout
from alight.testbed import Motors, Testbed
from alight.theory.case import Case
from alight.theory.inertia import inertia_bounds, inertia_box
from alight.theory.lyapunov import errors_at
from alight.theory.proven.contact import vtx_margin
from alight.theory.proven.local_stability import loc_margin
from tests.control.cases import true_theta_r

STRONG = Testbed(motors=Motors(limit=(1e9, 1e9)))
"""Motors that never clip: the force of the law reaches the joints as it is."""
SINGULAR = 0.02
"""Size of det(J) at which a run is cut [m^2]; the runs start near 0.1."""
EFFORT = 3000
"""Steps of a coarse solver after which a run is cut as too stiff."""
FEWEST = 500
"""Samples of a run, however short: enough for its integrals."""
X_0 = 0.206
INERTIAL = slice(2, 9, 3)
KINDS = (
    "roam",
    "roam (44)",
    "rest",
    "rest (44)",
    "VTX",
    "LOC fails",
    "fast X1",
    "fast X2 (44)",
    "slow",
)
"""The kind of a run is its seed modulo their number."""
SHARP = KINDS[-3:]
"""Starts with true estimates in narrow boxes, in which Proposition A is nearly an equality."""


@dataclass(frozen=True)
class Run:
    """One continuous run, up to where it is cut."""

    kind: str
    case: Case
    recording: Recording
    switches: np.ndarray
    """Times at which contact began or ended [s]."""
    cut: str
    """Why it was cut; empty if it was not."""


def log_uniform(rng: np.random.Generator, low: float, high: float, size: int | None = None) -> Any:
    return np.exp(rng.uniform(np.log(low), np.log(high), size))


def _pair(rng: np.random.Generator, low: float, high: float) -> tuple[float, float]:
    first, second = log_uniform(rng, low, high, 2)
    return float(first), float(second)


def random_plant(rng: np.random.Generator) -> Plant:
    p1, share, coupling = log_uniform(rng, 1.0, 4.0), rng.uniform(0.05, 0.2), rng.uniform(0.1, 0.5)
    p2 = share * p1
    p3 = coupling * np.sqrt((p1 - p2) * p2)
    return Plant(
        TwoLinkArm(rng.uniform(0.3, 0.4), rng.uniform(0.25, 0.35), p1, p2, p3),
        MassSpring(log_uniform(rng, 0.5, 4.0), log_uniform(rng, 200.0, 1500.0), x_0=X_0),
        LinearSpring(K_I=log_uniform(rng, 5e3, 5e4)),
    )


def random_gains(rng: np.random.Generator) -> Gains:
    return Gains(
        k1=log_uniform(rng, 0.3, 3.0),
        k2=log_uniform(rng, 0.2, 2.0),
        k3=_pair(rng, 5.0, 150.0),
        alpha1=log_uniform(rng, 3.0, 60.0),
        alpha2=log_uniform(rng, 5.0, 60.0),
        alpha3=log_uniform(rng, 0.1, 3.0),
        alpha=_pair(rng, 5.0, 60.0),
        Gamma=log_uniform(rng, 0.1, 3.0),
    )


def gains_for(kind: str, rng: np.random.Generator, plant: Plant) -> Gains:
    """Gains of a kind; those of VTX and beyond LOC are drawn until they are."""
    while True:
        gains = random_gains(rng)
        if kind == "VTX" and vtx_margin(gains, plant.body.m, plant.contact.K_I) <= 0:
            continue
        if kind == "LOC fails" and loc_margin(gains) >= 0:
            continue
        return gains


def random_law(kind: str, rng: np.random.Generator, plant: Plant) -> AdaptiveContactLaw:
    """A law whose boxes hold the truth; those of the inertias are narrow enough to admit one."""
    theta_r, near = true_theta_r(plant), kind in SHARP
    below, above = rng.uniform(0.3, 0.8, 10), rng.uniform(1.2, 3.0, 10)
    below[INERTIAL], above[INERTIAL] = rng.uniform(0.85, 0.97, 3), rng.uniform(1.03, 1.15, 3)
    if near:
        below, above = np.full(10, 1 - 1e-4), np.full(10, 1 + 1e-4)
    first = below + rng.uniform(0.0, 1.0, 10) * (above - below)
    boxed = (np.clip(v, below, above) * theta_r for v in (np.ones(10) if near else first,))
    cls = Unsaturated if kind.endswith("(44)") else ForceLimiting
    theta_dk = plant.theta_dk
    return cls(
        model=plant,
        target=Target(x_md=X_0 + rng.uniform(0.01, 0.05), x_rd2=rng.uniform(0.3, 0.42)),
        gains=gains_for(kind, rng, plant),
        e_f=rng.uniform(-0.8, 0.8),
        Gamma_r=tuple(log_uniform(rng, 1e-4, 1e-1, 10) * theta_r**2),
        theta_dk=Estimate(rng.uniform(0.6, 1.9) * theta_dk, theta_dk / 2, 2 * theta_dk),
        theta_r=Estimate(tuple(*boxed), tuple(below * theta_r), tuple(above * theta_r)),
    )


def random_start(kind: str, rng: np.random.Generator, law: AdaptiveContactLaw) -> InitialState:
    """Before the body, close to it, or pressed on it; at rest or moving; either elbow."""
    gap = float(rng.choice([-0.05, -0.005, 0.002]))
    moves = 1.0
    if kind.startswith("rest"):
        gap, moves = float(rng.uniform(-0.03, -0.002)), 0.0
    if kind == "VTX":
        gap, moves = float(rng.uniform(0.0, 3e-3)), float(rng.integers(2))
    if kind in SHARP:
        return sharp_start(kind, rng, law)
    q = law.model.arm.inverse((X_0 + gap, 0.4), rng.choice(["+", "-"]))
    q_dot, x_m_dot = moves * rng.uniform(-1.0, 1.0, 2), moves * rng.uniform(-0.3, 0.3)
    return InitialState(tuple(map(float, q)), X_0, tuple(map(float, q_dot)), float(x_m_dot))


def sharp_start(kind: str, rng: np.random.Generator, law: AdaptiveContactLaw) -> InitialState:
    """A start in which the bounds of Proposition A are nearly reached, the mass at rest.

    ``fast``: a pose in which the tip moves most easily along an axis, and ``r_r`` large there;
    ``slow``: no ``r_r`` at all, so that ``V_r`` is that of ``e_r``.
    """
    arm, axis = law.model.arm, int("X2" in kind)
    if kind == "slow":
        q = arm.inverse((X_0 - 0.05, law.target.x_rd2), rng.choice(["+", "-"]))
        r_r = np.zeros(2)
    else:
        q = easiest_pose(arm, axis, rng.choice([-1.0, 1.0]))
        r_r = np.array([-12.0, 0.0]) if axis == 0 else np.array([0.0, rng.choice([-6.0, 6.0])])
    at_rest = PlantState(q, np.zeros(2), X_0, 0.0, 0.0)
    e = errors_at(law, at_rest, AdaptiveState(**law.initial_state()))
    q_dot = np.linalg.solve(arm.J(q), np.asarray(e.r_r) - r_r)
    return InitialState(tuple(map(float, q)), X_0, tuple(map(float, q_dot)))


def easiest_pose(arm: TwoLinkArm, axis: int, elbow: float) -> np.ndarray:
    """Pose apart from the body whose ``M_bar`` is least, and diagonal."""
    best, found = 0.0, np.zeros(2)
    for q2 in elbow * np.linspace(0.05, np.pi - 0.05, 200):
        q = np.array([0.0, q2])
        J = arm.J(q)
        if abs(np.linalg.det(J)) < 2 * SINGULAR:
            continue
        values, vectors = np.linalg.eigh(J @ np.linalg.inv(arm.M(q)) @ J.T)
        if values[-1] > best:
            best, first = values[-1], vectors[:, -1]
            turn = axis * np.pi / 2 - np.arctan2(first[1], first[0])
            found = np.array([turn, q2])
    return found if arm.x_r(found)[0] < X_0 else found + np.array([np.pi, 0.0])


def case_for(law: AdaptiveContactLaw, start: InitialState) -> Case:
    """What a designer knows who knows the plant within a tenth, and its boxes."""
    plant = law.model
    m, K_I, k_s = plant.body.m, plant.contact.K_I, plant.body.k_s
    bounds = Assumptions(
        0.9 * m, 1.1 * m, (0.9 * K_I, 1.1 * K_I), (0.9 * k_s, 1.1 * k_s), -1.0, 1.0, 0.02
    )
    return Case(
        law=law,
        bounds=bounds,
        inertia=inertia_bounds(plant.arm, *inertia_box(law), bounds.sigma_J),
        plant=plant,
        s=PlantState(np.array(start.q), np.array(start.q_dot), start.x_m, start.x_m_dot, 0.0),
        a=AdaptiveState(**law.initial_state()),
    )


@functools.cache
def _rates(cls: type[AdaptiveContactLaw]) -> Direct:
    """Rate and det(J) of the continuous loop of a law with the plant that it is told of."""
    rng = np.random.default_rng(0)
    kind = "roam (44)" if cls is Unsaturated else "roam"
    law = lift(random_law(kind, rng, random_plant(rng)))
    x = ca.SX.sym("x", state_size(law.obj))
    rates, _ = continuous_rates(law.obj.model, law.obj, x)
    det_J = determinant(law.obj.model.arm.J(x[:2]))
    return Direct(build("rates", {"p": law.symbols, "x": x}, {"x_dot": rates, "det_J": det_J}))


class _TooStiff(Exception):
    def __init__(self, time: float) -> None:
        self.time = time


def resolved_until(law: AdaptiveContactLaw, start: InitialState, end: float) -> tuple[float, str]:
    """How far a tight solver can follow the loop [s], by a coarse run; and why no farther.

    Near a singular pose, and where the filter escapes, its steps tend to zero.
    """
    p, rates, steps = values_of(law), _rates(type(law)), itertools.count()
    plant = PlantState(np.array(start.q), np.array(start.q_dot), start.x_m, start.x_m_dot, 0.0)
    x = join_state(law, plant, dict(law.initial_state()))
    filter_ = PLANT.size + list(Layout(law.states).columns).index("u_f")

    def regular(t: float, x: np.ndarray) -> float:
        if next(steps) > EFFORT:
            raise _TooStiff(t)
        return float(np.abs(rates(p, x)[1][0]) - SINGULAR)

    def inside(_: float, x: np.ndarray) -> float:
        return float(1 - 1e-4 - np.abs(x[filter_]))

    events = [regular, inside]
    for event in events:
        event.terminal = True  # type: ignore[attr-defined]
    try:
        with np.errstate(all="ignore"), warnings.catch_warnings(action="ignore"):
            coarse = solve_ivp(
                lambda _, x: rates(p, x)[0], (0.0, end), x, method="LSODA", rtol=1e-6, events=events
            )
    except _TooStiff as stopped:
        return stopped.time, "too stiff"
    reasons = ("near a singular pose", "the filter escapes")
    ended = [why for why, at in zip(reasons, coarse.t_events, strict=True) if len(at)]
    if coarse.status < 0:
        return float(coarse.t[-2]), "too stiff"
    return float(coarse.t[-1]), ended[0] if ended else ""


def followed(
    kind: str, law: AdaptiveContactLaw, start: InitialState, end: float, rate: float = 4e3
) -> Run:
    """The continuous run from a start, cut where it is no longer resolved."""
    last, cut = resolved_until(law, start, end)
    loop = ClosedLoop(law.model, STRONG, law)
    times = np.linspace(0.0, last, max(round(last * rate), FEWEST) + 1)
    made = alight.reference(loop, start, times, rtol=1e-10, atol=1e-12)
    poses = np.abs(made.recording["det_J"]) > SINGULAR
    kept = len(poses) if poses.all() else int(np.argmin(poses))
    whole = made.recording
    recording = dataclasses.replace(whole, t=whole.t[:kept], samples=whole.samples[:kept])
    switches = made.switches[made.switches <= recording.t[-1]]
    return Run(kind, case_for(law, start), recording, switches, cut)


@functools.cache
def random_run(seed: int) -> Run:
    kind, rng = KINDS[seed % len(KINDS)], np.random.default_rng(seed)
    law = random_law(kind, rng, random_plant(rng))
    start = random_start(kind, rng, law)
    end, rate = (0.1, 2e4) if kind.startswith("fast") else (0.5, 4e3)
    return followed(kind, law, start, end, rate)
