"""What every statement of a certificate assumes, and whether the scenario keeps to it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from alight.models import LinearSpring
from alight.scenarios import Scenario
from alight.simulation import Recording
from alight.theory.case import Case
from alight.theory.inertia import inertia_bounds, least_singular_values


@dataclass(frozen=True)
class Assumed:
    """One assumption, who needs it, and what the scenario has instead."""

    about: Literal["knowledge", "model", "testbed", "motion"]
    what: str
    """The assumption."""
    source: str
    """Where the paper states it, or why we do."""
    holds: bool
    """Whether the scenario's plant, or its simulated run, keeps to it."""
    found: str
    """What the scenario has."""


def assumed(case: Case, scenario: Scenario, recording: Recording) -> tuple[Assumed, ...]:
    """Hold a scenario and its run against the assumptions of the paper and of our own proofs."""
    return (
        *_knowledge(case),
        *_model(case, scenario),
        *_testbed(scenario, recording),
        *_motion(case, recording),
    )


def _within(value: float, low: float, high: float) -> tuple[bool, str]:
    return low < value < high, f"{value:.4g} in ({low:.4g}, {high:.4g})"


def _knowledge(case: Case) -> Iterator[Assumed]:
    """The truth lies where the designer looks for it."""
    b, plant, law = case.bounds, case.plant, case.law
    K_I, k_s = plant.contact.K_I, plant.body.k_s
    for what, value, low, high in (
        ("m_l < m < m_u", plant.body.m, b.m_l, b.m_u),
        ("K_I within zeta_K", K_I, *b.zeta_K),
        ("k_s within zeta_ks", k_s, *b.zeta_ks),
    ):
        yield Assumed("knowledge", what, "Assumption 2, (11)", *_within(value, low, high))
    dk = (float(np.min(law.theta_dk.lower)), float(np.max(law.theta_dk.upper)))
    yield Assumed("knowledge", "theta_dk within its box", "(28)", *_within(plant.theta_dk, *dk))
    theta_r = law.theta_r_of(law.pi_of(plant))
    lower, upper = np.array(law.theta_r.lower), np.array(law.theta_r.upper)
    outside = [int(i) + 1 for i in np.flatnonzero((theta_r < lower) | (theta_r > upper))]
    told = f"entries {outside} outside" if outside else "every entry"
    yield Assumed("knowledge", "theta_r within its box", "(34)", not outside, told)
    if b.a1 is not None:
        p = np.array([getattr(plant.arm, name) for name in plant.arm.inertial])
        true = inertia_bounds(plant.arm, p, p, b.sigma_J).a1
        told = f"{true:.4g} kg at least, over all poses"
        yield Assumed("knowledge", "M_bar no smaller than a1", "(9)", true >= b.a1, told)
    least, most = b.zeta_ks[0] / b.zeta_K[1], b.zeta_ks[1] / b.zeta_K[0]
    covered = dk[0] <= least and most <= dk[1]
    told = f"[{least:.4g}, {most:.4g}] against the box [{dk[0]:.4g}, {dk[1]:.4g}]"
    yield Assumed(
        "knowledge",
        "the box of theta_dk holds every k_s / K_I that Assumption 2 admits",
        "(28) with (11)",
        covered,
        told,
    )


def _model(case: Case, scenario: Scenario) -> Iterator[Assumed]:
    """The plant is that of (1)-(8)."""
    arm, body, contact = scenario.plant.arm, scenario.plant.body, scenario.plant.contact
    lossless = isinstance(contact, LinearSpring)
    yield Assumed("model", "the contact is the spring (7)", "(7)-(8)", lossless, contact.type)
    rubbing = {
        "viscous joints": max(arm.viscous),
        "Coulomb friction of the joints": max(arm.coulomb),
        "damping of the mass": body.damping,
        "tip friction": scenario.plant.tip_friction.mu,
    }
    found = ", ".join(f"{name} {value:.3g}" for name, value in rubbing.items() if value)
    yield Assumed("model", "no friction, no damping", "(1)-(6)", not found, found or "none")
    moved = abs(case.s.x_m - body.x_0) + abs(case.s.x_m_dot)
    told = f"x_m(0) - x_0 = {case.s.x_m - body.x_0:.3g} m"
    yield Assumed("model", "the mass starts at rest at x_0", "Proposition C", not moved, told)


def _testbed(scenario: Scenario, recording: Recording) -> Iterator[Assumed]:
    """Continuous time, perfect sensors, motors that give what is asked."""
    bed = scenario.testbed
    told = f"sampled at {bed.sample_rate:g} Hz" + (", held back by a sample" if bed.delay else "")
    yield Assumed("testbed", "continuous time, measured velocities", "Assumption 3", False, told)
    clipped = float(np.mean(recording["clipped"].any(axis=1)))
    told = f"clipped in {clipped:.2%} of the samples of the run"
    yield Assumed(
        "testbed", "the motors give every torque that is asked", "(32)", clipped == 0, told
    )


def _motion(case: Case, recording: Recording) -> Iterator[Assumed]:
    """What is assumed of trajectories and can only be watched."""
    b, arm = case.bounds, case.plant.arm
    low, high = float(recording["x_r1"].min()), float(recording["x_m"].max())
    yield Assumed(
        "motion",
        "zeta_xr <= x_r1 and x_m <= zeta_xm",
        "Assumption 1, (4)",
        b.zeta_xr <= low and high <= b.zeta_xm,
        f"x_r1 >= {low:.4g} m, x_m <= {high:.4g} m along the run",
    )
    least = float(least_singular_values(arm, recording["q2"]).min())
    yield Assumed(
        "motion",
        "singular values of J above sigma_J",
        "Remark 1",
        least >= b.sigma_J,
        f"{least:.3g} m at least along the run",
    )
    reach = np.hypot(*recording["x_rd"].T)
    inner, outer = abs(arm.l1 - arm.l2), arm.l1 + arm.l2
    yield Assumed(
        "motion",
        "the desired tip position is within reach",
        "Remark 1",
        bool((reach > inner).all() and (reach < outer).all()),
        f"{reach.min():.3g} to {reach.max():.3g} m from the base along the run, reach "
        f"{inner:.3g} to {outer:.3g} m",
    )
    farthest = float(np.abs(recording["u_f"]).max())
    yield Assumed(
        "motion", "|u_f| < 1", "(18)", farthest < 1, f"|u_f| <= {farthest:.3g} along the run"
    )
    pressing = recording["Lambda"] > 0
    parted = int(np.sum(pressing[:-1] & ~pressing[1:]))
    yield Assumed(
        "motion",
        "contact, once made, is kept",
        "Case 2 of Appendix B",
        parted == 0 and bool(pressing.any()),
        f"{parted} separations in the run" if pressing.any() else "no contact in the run",
    )
