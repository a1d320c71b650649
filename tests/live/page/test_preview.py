"""The certificate of a draft says what the whole certificate says, and computes no run."""

import numpy as np
import pytest

import alight
from alight.live.bank import Bank
from alight.live.page.preview import Preview
from alight.symbolic.parameters import replaced
from alight.theory import check
from alight.theory.sampled import sampled_loops


@pytest.fixture(scope="module")
def scenario():
    return alight.load_scenario("experiment-1")


@pytest.fixture(scope="module")
def preview(scenario):
    return Preview(scenario)


@pytest.mark.parametrize("alpha1", [55.0, 20.0])
def test_it_agrees_with_the_certificate(scenario, preview, alpha1):
    law = replaced(Bank.of(scenario).loops[0], {"law.gains.alpha1": alpha1}).law
    lines = {line.name: line for line in preview.of(law).lines}
    whole = check(scenario.with_law(law))
    for name in ("LOC", "LOC, adapting", "VTX", "filter"):
        assert lines[name].holds == whole.condition(name).holds
    for phase, name in (("contact", "sampled, contact"), ("free motion", "sampled, free")):
        radii = [
            loop.adapting.now.radius
            for loop in sampled_loops(whole.case, scenario)
            if loop.present and loop.phase == phase
        ]
        assert float(lines[name].told) == pytest.approx(max(radii), abs=1e-5)
    latest = next(c for c in whole.constants if c.symbol == "t_contact").value
    assert float(lines["first contact"].told.removeprefix("≤ ")) == pytest.approx(latest, rel=1e-2)
    limits = {b.name: b.value for b in whole.newtons}
    told = [float(part) for part in lines["feedback force"].told.removeprefix("≤ ").split(", ")]
    assert np.allclose(told, [limits[f"feedback force, axis X{i}"] for i in (1, 2)], rtol=1e-2)
    low, high = (float(part) for part in lines["final force"].told.split("…"))
    final = next(b for b in whole.newtons if b.name == "final contact force")
    assert (low, high) == pytest.approx((final.lower, final.value), rel=1e-2)


def test_drafts_in_turn_do_not_disturb_one_another(scenario, preview):
    loop = Bank.of(scenario).loops[0]
    laws = [replaced(loop, {"law.gains.k1": k1}).law for k1 in (2.0, 4.0, 8.0)]
    first = [preview.of(law) for law in laws]
    assert [Preview(scenario).of(law) for law in reversed(laws)] == first[::-1]
    assert len({effect.lines for effect in first}) == len(laws)


def test_what_cannot_be_certified_says_why(scenario, preview):
    assert "does not adapt" in preview.of(Bank.of(scenario).loops[2].law).problem
    from tests.live.page.support import without_assumptions

    bare = without_assumptions(scenario)
    assert "[assumptions]" in Preview(bare).of(bare.law).problem
