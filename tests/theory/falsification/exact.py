"""Functions of CasADi evaluated to many digits."""

from __future__ import annotations

import operator
from collections.abc import Mapping

import casadi as ca
import mpmath
import numpy as np

from alight.kernels.lanes.graph import graph_of

DIGITS = 60
OPERATIONS = {
    "add": operator.add,
    "sub": operator.sub,
    "mul": operator.mul,
    "div": operator.truediv,
    "neg": operator.neg,
    "fabs": abs,
    "sign": mpmath.sign,
    "twice": lambda x: 2 * x,
    "sq": lambda x: x**2,
    "inv": lambda x: 1 / x,
    "fmax": max,
    "fmin": min,
    "lt": operator.lt,
    "le": operator.le,
    "eq": operator.eq,
    "ne": operator.ne,
    "not": operator.not_,
    "and": lambda x, y: bool(x) and bool(y),
    "or": lambda x, y: bool(x) or bool(y),
    "if_else_zero": lambda x, y: y if x else mpmath.mpf(0),
    **{name: getattr(mpmath, name) for name in ("sqrt", "exp", "log", "log1p", "sin", "cos")},
    "tanh": mpmath.tanh,
}


def exactly(function: ca.Function, inputs: np.ndarray) -> list[mpmath.mpf]:
    """The first entry of each output at one column of inputs, which count as exact."""
    graph = graph_of(function)
    values: list[mpmath.mpf] = []
    with mpmath.workdps(DIGITS):
        for node in graph.nodes:
            if node.op == "const":
                values.append(mpmath.mpf(node.value))
            elif node.op == "input":
                values.append(mpmath.mpf(float(inputs[node.value[1]])))
            else:
                values.append(OPERATIONS[node.op](*(values[i] for i in node.args)))
    return [values[entries[0]] for entries in graph.outputs]


def column(at: Mapping[str, float], names: tuple[str, ...]) -> np.ndarray:
    """Coordinates in the order of a function's input."""
    return np.array([at[name] for name in names])
