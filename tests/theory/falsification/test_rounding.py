"""The error bound that runs along with a computation, against 60 digits."""

from __future__ import annotations

import casadi as ca
import mpmath
import numpy as np
import pytest

from alight.errors import ExpressionError
from alight.theory.falsification import Claims, approach, estimates, robot
from alight.theory.falsification.hunt import Search
from alight.theory.falsification.judged import Evaluated, Judged
from alight.theory.falsification.rounding import with_rounding
from tests.theory.falsification.exact import DIGITS, column, exactly

PARTS = {"robot": robot, "approach": approach, "estimates": estimates}


@pytest.mark.parametrize("part", PARTS)
def test_what_is_computed_lies_within_the_bound_of_the_exact_value(part):
    made = [s for s in PARTS[part].searches(Claims()) if isinstance(s.violation, Judged)]
    assert made
    for search in made:
        assert_within_the_bound(search, search.violation.evaluated)


def assert_within_the_bound(search: Search, made: Evaluated) -> None:
    rng = np.random.default_rng(0)
    columns = search.space.columns(rng.random((search.space.size, 12)))
    values, errors = made(columns)
    for i in range(12):
        at = {name: row[i] for name, row in columns.items()}
        with mpmath.workdps(DIGITS):
            for name, exact in zip(
                made.names, exactly(made.graph, column(at, made.coordinates)), strict=True
            ):
                if np.isfinite(errors[name][i]):
                    assert abs(values[name][i] - exact) <= errors[name][i]


def test_the_bound_covers_a_cancellation():
    x = ca.SX.sym("x")
    function = ca.Function("f", [x], [ca.sqrt(1 + x) - 1])
    value, error = (float(v) for v in with_rounding(function)(1e-9))
    with mpmath.workdps(DIGITS):
        moved = abs(value - exactly(function, np.array([1e-9]))[0])
    assert 1e-18 < moved <= error < 1e-15


def test_an_operation_whose_error_is_not_known_is_refused():
    x = ca.SX.sym("x")
    with pytest.raises(ExpressionError, match="erf"):
        with_rounding(ca.Function("f", [x], [ca.erf(x)]))
