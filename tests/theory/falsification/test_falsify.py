"""Every claim withstands the searches; what they find is judged again to 60 digits."""

from __future__ import annotations

import functools

import mpmath
import numpy as np
import pytest

from alight.errors import UnknownName
from alight.theory.falsification import (
    Attempt,
    Claims,
    approach,
    estimates,
    falsify,
    markdown,
    robot,
)
from alight.theory.falsification.falsify import PROPOSITIONS
from alight.theory.falsification.judged import Judged
from tests.theory.falsification.exact import DIGITS, column, exactly


@functools.cache
def attempts(proposition: str) -> list[Attempt]:
    return falsify(only=[proposition])


@pytest.mark.parametrize(
    "proposition",
    [pytest.param(p, marks=[pytest.mark.slow] if p == "C" else []) for p in PROPOSITIONS],
)
def test_no_claim_is_broken(proposition):
    found = attempts(proposition)
    assert found
    for attempt in found:
        assert attempt.proposition == proposition
        assert not attempt.broken, attempt
        assert -1 <= attempt.best <= 0
        assert attempt.tries >= 10
        assert np.isfinite(list(attempt.at.values())).all()


@pytest.mark.slow
@pytest.mark.parametrize("proposition", PROPOSITIONS)
def test_no_claim_is_broken_at_full_effort(proposition):
    for attempt in falsify(1, "full", [proposition]):
        assert not attempt.broken, attempt


@pytest.mark.parametrize("part", [robot, pytest.param(approach, marks=pytest.mark.slow), estimates])
def test_the_best_attempts_break_nothing_in_exact_arithmetic_either(part):
    claims = [s for s in part.searches(Claims()) if isinstance(s.violation, Judged)]
    found = {a.claim: a for name in {s.proposition for s in claims} for a in attempts(name)}
    assert claims
    for search in claims:
        made = search.violation.evaluated
        at = column(found[search.claim].at, made.coordinates)
        excess, size = exactly(made.graph, at)
        with mpmath.workdps(DIGITS):
            assert excess <= size * mpmath.mpf(10) ** -40


def test_the_same_seed_gives_the_same_attempts_and_another_one_others():
    first, (again, other) = (
        attempts("projection"),
        (falsify(s, only=["projection"]) for s in (0, 1)),
    )
    assert first == again
    assert [a.at for a in first] != [a.at for a in other]


def test_an_unknown_proposition_is_refused():
    with pytest.raises(UnknownName, match="'E'"):
        falsify(only=["E"])


def test_the_page_shows_every_attempt_and_where_a_claim_breaks():
    fine = Attempt("A", "falls", 1234, -1e-3, {"k1": 1.0}, "by hand")
    wrong = Attempt("B", "rises", 10, 0.25, {"k1": 2.0, "u_f": 0.5}, "by hand")
    page = markdown([fine, wrong])
    assert "| A | falls | 1,234 | -1.0e-03 | not broken |" in page
    assert "| B | rises | 10 | 2.5e-01 | BROKEN |" in page
    assert page.count("Broken") == 1 and "k1 = 2, u_f = 0.5" in page
