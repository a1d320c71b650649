"""Tightly integrated runs of random closed loops, with the errors that Propositions A-C bound."""

from __future__ import annotations

import dataclasses
import functools
from typing import NamedTuple

import numpy as np

import alight
from alight.control import AdaptiveContactLaw, AdaptiveState, ForceLimiting, Unsaturated
from alight.models import PlantState
from alight.simulation.closed_loop import ClosedLoop, InitialState
from tests.control.cases import true_theta_r
from tests.theory.test_decrease import SINGULAR, STRONG, random_law, random_start


class Run(NamedTuple):
    """One run, cut where the arm comes near a singular pose."""

    law: AdaptiveContactLaw
    s: PlantState
    a: AdaptiveState
    t: np.ndarray
    e_r: np.ndarray
    r_r: np.ndarray
    e_m: np.ndarray
    gap: np.ndarray


def follow(
    law: AdaptiveContactLaw, start: InitialState, end: float = 0.5, count: int = 2001
) -> Run:
    times = np.linspace(0.0, end, count)
    loop = ClosedLoop(law.model, STRONG, law)
    seen = alight.reference(loop, start, times, rtol=1e-9, atol=1e-11).recording
    poses = np.abs(seen["det_J"]) > SINGULAR
    kept = len(poses) if poses.all() else int(np.argmin(poses))
    s = PlantState(np.array(start.q), np.array(start.q_dot), start.x_m, start.x_m_dot, 0.0)
    a = AdaptiveState(**law.initial_state())
    signals = (seen[name][:kept] for name in ("e_r", "r_r", "e_m", "gap"))
    return Run(law, s, a, seen.t[:kept], *signals)


@functools.cache
def random_run(seed: int) -> Run:
    """Free motion, contact or both, under (32) or (44); from true estimates where 3 divides."""
    rng = np.random.default_rng(seed)
    law = random_law(rng)
    start = random_start(rng, law.model)
    if seed % 3 == 0:
        true = dataclasses.replace(law.theta_r, initial=tuple(true_theta_r(law.model)))
        law = dataclasses.replace(law, theta_r=true)
    if seed % 2:
        fields = {f.name: getattr(law, f.name) for f in dataclasses.fields(ForceLimiting)}
        law = Unsaturated(**fields)
    return follow(law, start)
