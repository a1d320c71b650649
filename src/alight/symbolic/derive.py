"""Derivatives that nobody types: Jacobians, time derivatives, regressors.

Each verb takes a *function* and the point at which its derivative is wanted. The function is traced
on fresh symbols, differentiated, and put back at the point, so that the same call serves numbers
and expressions.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import casadi as ca
import numpy as np

from alight.errors import ExpressionError
from alight.symbolic.ops import Matrix, Vector, as_expression, is_symbolic
from alight.symbolic.parameters import is_parameters, symbols_of


def _fresh(values: Sequence[Any]) -> list[ca.SX]:
    sizes = [v.numel() if isinstance(v, ca.SX) else int(np.size(v)) for v in values]
    return [ca.SX.sym(f"arg{i}", size) for i, size in enumerate(sizes)]


def _at(expression: ca.SX, symbols: list[ca.SX], values: Sequence[Any]) -> Any:
    """Put values in place of symbols; numbers when nothing symbolic is left."""
    placed = ca.substitute([expression], symbols, [as_expression(v) for v in values])[0]
    if not placed.is_constant():
        return placed
    result = ca.evalf(placed).full()
    if result.shape == (1, 1):
        return float(result[0, 0])
    return result[:, 0] if result.shape[1] == 1 else result


def _refuse_undeclared(expression: ca.SX, declared: list[ca.SX], constants: Any) -> None:
    known = {s.element_hash() for column in declared for s in ca.vertsplit(column)}
    if is_parameters(constants):
        known |= {s.element_hash() for s in symbols_of(constants)}
    unknown = [s.name() for s in ca.symvar(expression) if s.element_hash() not in known]
    if unknown:
        raise ExpressionError(
            f"no rate is declared for {', '.join(sorted(set(unknown)))}: differentiation would "
            "take it for a constant; pass it as an argument with its rate"
        )


def jacobian(function: Callable[[Any], Any], at: Vector) -> Matrix:
    """Matrix of the partial derivatives of ``function`` at ``at``."""
    (x,) = symbols = _fresh([at])
    return _at(ca.densify(ca.jacobian(function(x), x)), symbols, [at])


def time_derivative(
    function: Callable[..., Any], at: Sequence[Any], rates: Sequence[Any], constants: Any = None
) -> Any:
    """Rate of ``function`` at ``at`` when its arguments move at ``rates``.

    ``constants`` is the parameter set that the function reads besides its arguments.

    Raises
    ------
    ExpressionError
        If the function depends on a symbol that is neither an argument nor in ``constants``.
    """
    symbols = _fresh(at)
    value = function(*symbols)
    _refuse_undeclared(value, symbols, constants)
    speeds = _fresh(rates)
    columns = [value[:, j] for j in range(value.shape[1])]
    along = ca.horzcat(
        *(ca.jtimes(column, ca.vertcat(*symbols), ca.vertcat(*speeds)) for column in columns)
    )
    return _at(ca.densify(along), symbols + speeds, [*at, *rates])


def regressor(
    linear: Callable[[ca.SX], ca.SX], monomials: Callable[[ca.SX], ca.SX], size: int
) -> Matrix:
    """Return ``Y`` such that ``linear(pi) = Y monomials(pi)`` for every ``pi`` of ``size`` entries.

    Raises
    ------
    ExpressionError
        If ``linear`` is not linear in the monomials.
    """
    pi = ca.SX.sym("pi", size)
    value, theta = linear(pi), monomials(pi)
    zero = ca.SX.zeros(size)
    columns = []
    for i in range(theta.numel()):
        partial = value
        for factor in ca.symvar(theta[i]):
            partial = ca.jacobian(partial, factor)
        columns.append(ca.substitute(partial, pi, zero))
    matrix = ca.densify(ca.horzcat(*columns))
    _refuse_nonlinear(value, matrix @ theta)
    return matrix if ca.symvar(matrix) else ca.evalf(matrix).full()


_SCALES = (1.0, 0.5, 1e3, 1e4, 1e5, 1e6)


def _refuse_nonlinear(value: ca.SX, linear_part: ca.SX) -> None:
    free = ca.symvar(ca.veccat(value, linear_part))
    check = ca.Function("check", [ca.vertcat(*free)], [value, linear_part])
    rng = np.random.default_rng(0)
    compared = 0
    for scale in _SCALES:  # a sensor's rounding can make every small number a singular pose
        full, part = (np.asarray(v) for v in check(scale * rng.uniform(0.2, 0.8, len(free))))
        if not (np.isfinite(full).all() and np.isfinite(part).all()):
            continue
        compared += 1
        if not np.allclose(full, part, rtol=1e-6, atol=1e-6 * np.abs(full).max()):
            raise ExpressionError(
                "the expression is not linear in the given monomials: "
                f"{full.ravel()} against {part.ravel()} at a random point"
            )
    if not compared:
        raise ExpressionError("the expression is not finite at any point where it was tried")


def traced(function: Callable[..., Any], *sizes: int) -> Callable[..., Any]:
    """The same function of vectors of the given sizes, its body run only once, on symbols.

    What it closes over stays in its expressions: let nothing large be among it.
    """
    symbols = [ca.SX.sym(f"arg{i}", size) for i, size in enumerate(sizes)]
    expression = ca.densify(ca.SX(function(*symbols)))
    return lambda *args: _at(expression, symbols, args)


def evaluated(function: Callable[..., Any], *args: Any) -> Any:
    """Value of a function whose body needs symbols, at numbers or expressions."""
    if is_symbolic(*args):
        return function(*args)
    symbols = _fresh(args)
    return _at(ca.densify(ca.SX(function(*symbols))), symbols, args)
