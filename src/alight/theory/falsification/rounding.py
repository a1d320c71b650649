"""How far rounding can have moved a result: a bound that runs along with the computation.

A search that maximises a violation finds the worst rounding there is. What it finds counts only
beyond this bound, which each operation derives from those of its arguments: the running error
analysis of Wilkinson, to all orders but for the last bits of the bound itself.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np

from alight.errors import ExpressionError
from alight.kernels.lanes.graph import COMPARISONS, Node, graph_of

UNIT = float(np.finfo(float).eps)
"""Twice the error of one rounding, relative; mathematical functions are within it, nearly."""
TINY = 1e-300


def _over(y: Any, dy: Any) -> Any:
    """What a denominator is in magnitude at least."""
    return ca.fmax(ca.fabs(y) - dy, TINY)


ERRORS: dict[str, Callable[..., Any]] = {
    "add": lambda z, x, dx, y, dy: dx + dy,
    "sub": lambda z, x, dx, y, dy: dx + dy,
    "mul": lambda z, x, dx, y, dy: ca.fabs(x) * dy + ca.fabs(y) * dx + dx * dy,
    "div": lambda z, x, dx, y, dy: (dx + ca.fabs(z) * dy) / _over(y, dy),
    "fmax": lambda z, x, dx, y, dy: ca.fmax(dx, dy),
    "fmin": lambda z, x, dx, y, dy: ca.fmax(dx, dy),
    "if_else_zero": lambda z, x, dx, y, dy: ca.if_else(x, dy, 0),
    "sq": lambda z, x, dx: 2 * ca.fabs(x) * dx + dx**2,
    "twice": lambda z, x, dx: 2 * dx,
    "inv": lambda z, x, dx: ca.fabs(z) * dx / _over(x, dx),
    "sqrt": lambda z, x, dx: ca.fmin(ca.sqrt(dx), dx / ca.fmax(z, TINY)),
    "exp": lambda z, x, dx: z * ca.expm1(dx),
    "log1p": lambda z, x, dx: dx / _over(1 + x, dx),
    "log": lambda z, x, dx: dx / _over(x, dx),
    "sign": lambda z, x, dx: 0,
    **dict.fromkeys(("neg", "fabs", "assign", "sin", "cos", "tanh"), lambda z, x, dx: dx),
}
"""Error of a result from its arguments and theirs, before its own rounding."""
EXACT = ("neg", "fabs", "sign", "assign", "fmax", "fmin", "if_else_zero", "twice")
"""Operations that do not round."""


def with_rounding(function: ca.Function) -> ca.Function:
    """The same function of its inputs, which count as exact, with an error bound on each output.

    Its outputs are those of ``function``, then their bounds in the same order. Where a comparison
    is decided by rounding the bound covers it if both branches meet there, as those of the model
    do.

    Raises
    ------
    ExpressionError
        If the function holds an operation whose error is not known.
    """
    inputs = [ca.SX.sym(function.name_in(i), function.numel_in(i)) for i in range(function.n_in())]
    graph = graph_of(function)
    values: list[Any] = []
    errors: list[Any] = []
    for node in graph.nodes:
        value, error = _step(node, inputs, values, errors)
        values.append(value)
        errors.append(error)
    outputs = [
        ca.vertcat(*(side[i] for i in entries))
        for side in (values, errors)
        for entries in graph.outputs
    ]
    return ca.Function(f"{function.name()}_with_rounding", inputs, outputs)


def _step(node: Node, inputs: list[ca.SX], values: list[Any], errors: list[Any]) -> tuple[Any, Any]:
    if node.op == "const":
        return ca.SX(node.value), ca.SX(0)
    if node.op == "input":
        which, entry = node.value  # type: ignore[misc]
        return inputs[which][entry], ca.SX(0)
    arguments = [values[i] for i in node.args]
    value = OPERATIONS[node.op](*arguments) if node.op in OPERATIONS else None
    if value is None:
        raise ExpressionError(f"rounding of {node.op} is not known; add it to ERRORS")
    if node.op in COMPARISONS:
        return value, ca.SX(0)
    pairs = [part for i in node.args for part in (values[i], errors[i])]
    error = ERRORS[node.op](value, *pairs)
    return value, error if node.op in EXACT else error + UNIT * ca.fabs(value)


OPERATIONS: dict[str, Callable[..., Any]] = {
    "add": lambda x, y: x + y,
    "sub": lambda x, y: x - y,
    "mul": lambda x, y: x * y,
    "div": lambda x, y: x / y,
    "neg": lambda x: -x,
    "twice": lambda x: 2 * x,
    "inv": lambda x: 1 / x,
    "sq": lambda x: x**2,
    "assign": lambda x: x,
    "if_else_zero": lambda x, y: ca.if_else(x, y, 0),
    "lt": lambda x, y: x < y,
    "le": lambda x, y: x <= y,
    "eq": lambda x, y: x == y,
    "ne": lambda x, y: x != y,
    "not": ca.logic_not,
    "and": ca.logic_and,
    "or": ca.logic_or,
    **{
        name: getattr(ca, name)
        for name in (
            "fmax",
            "fmin",
            "sqrt",
            "exp",
            "log",
            "log1p",
            "fabs",
            "sign",
            "sin",
            "cos",
            "tanh",
        )
    },
}
"""How each operation is made again."""
