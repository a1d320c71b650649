"""The conditions of Theorem 1 at the paper's gains, at a design that satisfies them, and more."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import alight
from alight.models import LinearSpring, MassSpring, Plant
from alight.symbolic.parameters import rebind
from alight.theory import V
from alight.theory.proven import vtx_margin
from alight.theory.theorem_1 import Corrected, Printed, design_of, evaluate, theorem_1, zeta_1
from tests.theory.theorem_1.designs import SPECIMEN, case, random_design, with_gains

READINGS = (Printed(), Corrected())
NUMBERS = [
    *("(26)", "(37)", "(38), first", "(38), second", "(59)", "(62)", "(39)"),
    *("(65), (66)", "(67)", "(69)", "(70), k1", "(70), k2"),
]


def sound(reading):
    """Every number is finite, every missing one is explained, and nothing holds without one."""
    for made in reading.constants:
        assert (made.value is None) == bool(made.undefined), made
        assert made.value is None or np.isfinite(made.value), made
    for made in (*reading.conditions, *reading.joint):
        assert (made.left is None or made.right is None) == bool(made.undefined), made
        assert all(side is None or np.isfinite(side) for side in (made.left, made.right)), made
        assert made.meaning and made.statement and not (made.fails and made.margin is not None)
    return True


@pytest.mark.parametrize("name", ["experiment-1", "experiment-2"])
@pytest.mark.parametrize("which", ["printed", "corrected"])
def test_the_paper_s_gains_fail_its_conditions(name, which):
    reading = getattr(theorem_1(case(name)), which)
    assert sound(reading) and [made.number for made in reading.conditions] == NUMBERS
    assert reading.holds is False
    for number in ("(26)", "(38), first", "(38), second", "(59)", "(39)"):
        assert reading.condition(number).holds is False, number
    assert reading.condition("(37)").holds
    assert "no k_n1" in reading.constant("k_n1").meaning
    assert all(made.holds is False for made in reading.joint)
    assert reading.constant("V_u").undefined.startswith("V_u is undefined: eps_x >= ")


def test_the_printed_bound_of_k1_in_70_fails_whatever_epsilon_f_is():
    """k1 = 2 and 0.22 against 0.03; as corrected it is k1 sinh(eps_f) cosh(eps_f), unknown."""
    for name in ("experiment-1", "experiment-2"):
        both = theorem_1(case(name))
        for number in ("(67)", "(69)", "(70), k1", "(70), k2"):
            assert both.printed.condition(number).holds is False, number
        assert both.corrected.condition("(70), k1").holds is None
    assert theorem_1(case("experiment-1")).corrected.condition("(70), k2").holds is False


def test_the_specimen_satisfies_every_condition_in_both_readings():
    both = theorem_1(case(SPECIMEN))
    for reading in (both.printed, both.corrected):
        assert sound(reading) and reading.holds
        assert [made.number for made in reading.conditions] == NUMBERS
        assert all(made.holds for made in (*reading.conditions, *reading.joint))
        assert all(made.value is not None for made in reading.constants)


def test_the_specimen_fails_as_soon_as_its_contact_is_ten_times_as_stiff():
    stiff = {"assumptions.zeta_K": [0.038, 0.042], "assumptions.zeta_ks": [0.038, 0.041]}
    both = theorem_1(case(SPECIMEN, stiff))
    for reading in (both.printed, both.corrected):
        assert reading.holds is False and not reading.joint[0].holds


def test_the_constants_of_the_specimen_typed():
    made = case(SPECIMEN)
    d, both = design_of(made), theorem_1(made)
    g, b = d.gains, d.bounds
    low, high = b.zeta_K
    slowest = min(g.alpha1 * g.k2 * low, g.alpha3 * g.k2 * low, g.alpha2)
    k_n1 = (g.k1 * b.m_l - 3) / zeta_1(g, b.m_u) ** 2
    width = 0.2 * np.array(made.law.theta_r.initial)
    typed = {
        "lambda_1": (max(d.inertia.a2 / 2, 1, 355, g.k2 * high), d.inertia.a2 / 2),
        "beta": 2 * [slowest - 1 / (4 * g.alpha2 * k_n1)],
        "eps_x": ((high * 0.25) ** 2 / g.alpha2, (high * 0.8) ** 2 / (4 * g.alpha2)),
        "zeta_theta": (
            high * 1.1**2 / 2 + (width @ width) / 2,
            high * 0.21**2 / 2 + 1.05**2 * (width @ width) / 2,
        ),
        "eps_m": 2 * [0.03],
        "eps_m_upper": 2 * [0.236 + 0.55],
    }
    for symbol, values in typed.items():
        found = (both.printed.constant(symbol).value, both.corrected.constant(symbol).value)
        np.testing.assert_allclose(found, values, rtol=2e-4, err_msg=symbol)
    for reading in (both.printed, both.corrected):
        u_f = np.sqrt(reading.constant("eps_x").value / reading.constant("lambda").value)
        assert reading.constant("eps_f").value == pytest.approx(np.arctanh(u_f))
        needed = (np.sqrt(2 * reading.constant("V_u").value / d.inertia.a1) + 1) ** 2
        assert reading.condition("(39)").right == pytest.approx(needed)
    printed = both.printed
    assert printed.constant("V(0)").value == pytest.approx(
        printed.constant("lambda_1").value * d.z_bar**2 + printed.constant("zeta_theta").value
    )


@pytest.mark.parametrize("name", ["experiment-1", SPECIMEN], ids=["experiment-1", "specimen"])
def test_V_0_bounds_V_at_the_start_for_every_truth_within_the_bounds(name):
    made = case(name)
    law, b, d = made.law, made.bounds, design_of(made)
    rng = np.random.default_rng(0)
    lower, upper = np.array(law.theta_r.lower), np.array(law.theta_r.upper)
    inside = 0
    true = made.plant
    for _ in range(300):
        p1, p2, p3, m, k_s, K_I = rng.uniform(0.95, 1.03, 6)
        arm = true.arm
        arm = rebind(arm, p1=p1 * arm.p1, p2=p2 * arm.p2, p3=p3 * arm.p3)
        body = MassSpring(m * true.body.m, k_s * true.body.k_s, law.model.body.x_0)
        plant = Plant(arm, body, LinearSpring(K_I=K_I * true.contact.K_I))
        theta_r = law.theta_r_of(law.pi_of(plant))
        known = b.m_l < body.m < b.m_u and b.zeta_K[0] < plant.contact.K_I < b.zeta_K[1]
        if not known or ((theta_r < lower) | (theta_r > upper)).any():
            continue
        inside += 1
        assert V(plant, law, made.s, made.a) <= d.V_0
    assert inside >= 5


def test_another_feedback_is_judged_as_if_it_were_32():
    """Theorem 1 speaks of no other law."""
    saturated = case("experiment-1")
    unsaturated = case("experiment-1", {"law.type": "unsaturated"})
    assert theorem_1(unsaturated) == theorem_1(saturated)


def test_26_and_37_hold_together_just_where_some_k_n1_satisfies_both():
    rng = np.random.default_rng(1)
    verdicts = set()
    for _ in range(300):
        d = random_design(rng)
        g, b = d.gains, d.bounds
        zeta, low = zeta_1(g, b.m_u), b.zeta_K[0]
        floor = 1 / (4 * g.alpha2 * min(g.alpha1 * g.k2 * low, g.alpha3 * g.k2 * low, g.alpha2))
        some = g.k1 >= (3 + 1.000001 * floor * zeta**2) / b.m_l
        for f in READINGS:
            reading = evaluate(d, f)
            assert sound(reading)
            assert reading.condition("(26)").holds == some
            assert reading.condition("(37)").holds
            assert 0 < reading.constant("beta").value < floor**-1 / (4 * g.alpha2)
        verdicts.add(bool(some))
    assert verdicts == {True, False}


def test_26_and_37_imply_VTX_for_every_mass_and_stiffness_within_the_bounds():
    rng = np.random.default_rng(2)
    judged = 0
    for _ in range(2000):
        d = random_design(rng)
        g, b = d.gains, d.bounds
        low = b.zeta_K[0]
        slowest = min(g.alpha1 * g.k2 * low, g.alpha3 * g.k2 * low, g.alpha2)
        # k1 just at the border, which VTX must therefore lie beyond
        k1 = (3 + zeta_1(g, b.m_u) ** 2 / (4 * g.alpha2 * slowest)) / b.m_l * (1 + 1e-9)
        at_border = with_gains(d, k1=k1)
        assert evaluate(at_border, Corrected()).condition("(26)").holds
        m, K_I = rng.uniform(b.m_l, b.m_u), rng.uniform(*b.zeta_K)
        assert vtx_margin(at_border.gains, b.m_u, low) > 0
        assert vtx_margin(at_border.gains, m, K_I) > 0
        judged += 1
    assert judged == 2000


def test_a_change_of_the_unit_of_mass_changes_the_verdicts():
    """(26) adds 3 kg to a gain and (37) compares N/s with 1/s: in tonnes the specimen fails."""
    d = design_of(case(SPECIMEN))
    b = d.bounds
    for f in READINGS:
        assert evaluate(d, f).holds
    tonne = 1e-3

    def pair(values):
        return tuple(tonne * v for v in values)

    in_tonnes = dataclasses.replace(
        with_gains(d, k3=pair(d.gains.k3)),
        bounds=dataclasses.replace(
            b,
            m_l=tonne * b.m_l,
            m_u=tonne * b.m_u,
            zeta_K=pair(b.zeta_K),
            zeta_ks=pair(b.zeta_ks),
        ),
        inertia=dataclasses.replace(d.inertia, a1=tonne * d.inertia.a1, a2=tonne * d.inertia.a2),
        V_0=tonne * d.V_0,
    )
    for f in READINGS:
        found = evaluate(in_tonnes, f)
        assert found.holds is False and found.condition("(26)").holds is False


def test_a_change_of_the_unit_of_mass_leaves_VTX_alone():
    d = design_of(case(SPECIMEN))
    m, K_I = d.bounds.m_u, d.bounds.zeta_K[0]
    assert vtx_margin(d.gains, m, K_I) == pytest.approx(
        vtx_margin(d.gains, 1e-3 * m, 1e-3 * K_I), rel=1e-9
    )


def test_what_stands_in_the_specimen_is_assumed_throughout():
    provenance = alight.load_scenario(SPECIMEN).provenance
    assert provenance and {source.kind for source in provenance.values()} == {"assumed"}
