"""Each search finds the violation where what it attacks is falsified on purpose."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from alight.symbolic.ops import dot
from alight.theory import lyapunov, proven
from alight.theory.falsification import (
    Claims,
    approach,
    contact,
    estimates,
    local,
    robot,
    runs,
    theorem,
)
from alight.theory.theorem_1 import Printed, zeta_1


def with_k3_doubled(law, e):
    saturated = law.feedback(e.e_r, e.r_r) - law.feedback(e.e_r, 0 * e.r_r)
    return lyapunov.dissipation(law, e) + dot(e.r_r, saturated)


def at_vertex(a, b):
    return lambda gains, m, K_I: proven.schur_margin(gains, m, K_I, a, b)


def sooner(share):
    def claimed(*case):
        found = first_contact_of(*case)
        return type(found)(found.u_inf, found.s_inf, found.latest and share * found.latest)

    first_contact_of = Claims().first_contact
    return claimed


FALSE = {
    "V_r with k3 doubled": (robot, 0, {"dissipation": with_k3_doubled}),
    "truth outside of its box": (robot, 0, {"outside": 0.05}),
    "truth hardly outside of its box, law (44)": (robot, 1, {"outside": 0.001}),
    "r_r without 1 percent of it": (robot, 3, {"r_r_squared": lambda V, m: 1.98 * V * m}),
    "e_r1^2 below e_r1 f(e_r1)": (robot, 4, {"steepness": lambda e, f: 1.0}),
    "(39) a third as strong": (robot, 5, {"tracking": lambda r, f: r / f / 3.1}),
    "VTX at (1, 0) alone": (contact, 0, {"vtx_margin": at_vertex(1.0, 0.0)}),
    "VTX at (0, 1) alone": (contact, 0, {"vtx_margin": at_vertex(0.0, 1.0)}),
    "VTX with 8 for 4": (
        contact,
        0,
        {"vtx_margin": lambda g, m, K: proven.vtx_margin(g, m, 2 * K)},
    ),
    "VTX with 1 percent more": (
        contact,
        0,
        {"vtx_margin": lambda *design: 1.01 * proven.vtx_margin(*design)},
    ),
    "VTX least at (1, 0)": (contact, 2, {"vtx_margin": at_vertex(1.0, 0.0)}),
    "VTX least at (0, 1)": (contact, 2, {"vtx_margin": at_vertex(0.0, 1.0)}),
    "VTX least a hundredth off rest": (contact, 2, {"vtx_margin": at_vertex(0.99, 1.0)}),
    "VTX implies more than LOC": (
        contact,
        1,
        {"loc_margin": lambda g: proven.loc_margin(g) - 2 * g.alpha2 / g.k1},
    ),
    "s_inf above 1 percent of k2 w": (
        approach,
        0,
        {"least_lead": lambda gains, w: 0.01 * gains.k2 * w},
    ),
    "fall by the lead with alpha_1 doubled": (
        approach,
        1,
        {"approach": lambda law, s, f: 2 * law.gains.alpha[0] * s * f},
    ),
    "Jensen beyond 0.658": (approach, 2, {"swing_floor": lambda d: np.tanh(d) ** 2}),
    "filter with alpha3": (
        approach,
        3,
        {"filter_room": lambda g, e_m, v: proven.filter_room(g, e_m, v) + g.alpha3},
    ),
    "LOC without alpha3": (
        local,
        0,
        {"loc_margin": lambda g: proven.loc_margin(g) - g.alpha3},
    ),
    "LOC although theta_dk_hat adapts": (
        local,
        1,
        {"loc_adapting_margin": lambda g, *_: proven.loc_margin(g)},
    ),
    "the whole loop without adaptation": (local, 2, {"decisive": (4, 5, 7)}),
    "the stiffest contact is the worst": (
        local,
        3,
        {"loc_adapting_margin": lambda g, kappa, d: -proven.loc_adapting_margin(g, kappa, d)},
    ),
    "projection with the truth in the layer": (estimates, 0, {"outside": 0.01}),
    "estimates within 9 tenths of the layer": (estimates, 1, {"edge": 0.9}),
    "(49) as printed (E5)": (theorem, 0, {"formulas": Printed()}),
    "zeta_1 with a tenth less": (theorem, 1, {"zeta_1": lambda g, m: 0.9 * zeta_1(g, m)}),
    "(71) as printed (E18)": (
        theorem,
        2,
        {"of_eta": lambda alpha2, K_I, alpha_1: alpha2 - K_I / (4 * alpha_1)},
    ),
}


COSTLY = {
    "truth hardly outside of its box, law (44)",
    "r_r without 1 percent of it",
    "e_r1^2 below e_r1 f(e_r1)",
    "(39) a third as strong",
    "the whole loop without adaptation",
    "the stiffest contact is the worst",
}


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[pytest.mark.slow] if n in COSTLY else []) for n in FALSE]
)
def test_a_falsified_claim_is_broken(name):
    part, i, changed = FALSE[name]
    search = next(itertools.islice(part.searches(Claims(**changed)), i, None))
    assert search.run(0, "quick").broken


@pytest.mark.slow
def test_a_first_contact_claimed_too_soon_is_missed_by_a_run():
    (search,) = runs.searches(Claims(first_contact=sooner(0.25)))
    assert search.run(0, "quick").broken


def test_below_the_limit_of_the_contact_stiffness_a_design_is_found():
    found = list(theorem.joint(Claims(stiffness=0.5), 0, "quick"))
    assert found[1].broken
