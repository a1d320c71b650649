"""Random functions of every operation, and what a few roundings in each of them may do."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from scipy import special

from alight.kernels.lanes.graph import COMPARISONS, Graph
from alight.symbolic.build import build

INPUTS, NUMBERS = 6, 4
"""Entries of the two inputs that a random function reads: those of a tick, and parameters."""
PARAMETERS = 2


def bounded(x: Any) -> Any:
    return ca.tanh(x)


def positive(x: Any) -> Any:
    return ca.fabs(x) + 0.5


ONE: dict[str, Callable[[Any], Any]] = {
    "neg": lambda a: -a,
    "sq": lambda a: bounded(a) ** 2,
    "cube": lambda a: bounded(a) ** 3,
    "twice": lambda a: 2 * a,
    "inv": lambda a: 1 / positive(a),
    "sqrt": lambda a: ca.sqrt(ca.fabs(a)),
    "root of what may be zero": lambda a: ca.sqrt(ca.fmax(a, 0)),
    "constpow": lambda a: positive(a) ** 1.7,
    "floor": ca.floor,
    "ceil": ca.ceil,
    "fabs": ca.fabs,
    "sign": ca.sign,
    "sin": ca.sin,
    "cos": ca.cos,
    "tan": lambda a: ca.tan(bounded(a)),
    "asin": lambda a: ca.asin(0.9 * bounded(a)),
    "acos": lambda a: ca.acos(0.9 * bounded(a)),
    "atan": ca.atan,
    "sinh": lambda a: ca.sinh(bounded(a)),
    "cosh": lambda a: ca.cosh(bounded(a)),
    "tanh": ca.tanh,
    "asinh": ca.asinh,
    "acosh": lambda a: ca.acosh(1 + positive(a)),
    "atanh": lambda a: ca.atanh(0.9 * bounded(a)),
    "exp": lambda a: ca.exp(3 * bounded(a)),
    "expm1": lambda a: ca.expm1(bounded(a)),
    "log": lambda a: ca.log(positive(a)),
    "log1p": lambda a: ca.log1p(ca.fabs(a)),
    "erf": ca.erf,
    "not": ca.logic_not,
    "one or zero": lambda a: ca.if_else(a, 1, 0) + a,
    "mask of a mask": lambda a: ca.if_else(a > 0.3, 1, 0) > 0,
    "mask of a value": lambda a: ca.if_else(a, 1, 0) > 0,
    "turned by little": lambda a: ca.sin(a) + ca.cos(a + 1e-3 * bounded(3 * a)),
    "turned by much": lambda a: ca.cos(a) * ca.sin(a + 50 * bounded(a)),
    "turned twice": lambda a: ca.sin(a) + ca.sin((a + 0.01) + 0.02 * ca.sin(a)),
    "over a constant": lambda a: a / 3 + a / 7,
}
TWO: dict[str, Callable[[Any, Any], Any]] = {
    "add": lambda a, b: a + b,
    "sub": lambda a, b: a - b,
    "mul": lambda a, b: bounded(a) * b,
    "div": lambda a, b: a / positive(b),
    "shared denominator": lambda a, b: a / positive(b) + bounded(a) / positive(b) - 1 / positive(b),
    "fmin": ca.fmin,
    "fmax": ca.fmax,
    "pow": lambda a, b: positive(a) ** bounded(b),
    "atan2": ca.atan2,
    "hypot": ca.hypot,
    "fmod": lambda a, b: ca.fmod(a, positive(b)),
    "remainder": lambda a, b: ca.remainder(a, positive(b)),
    "copysign": ca.copysign,
    "lt": lambda a, b: a < b,
    "le": lambda a, b: a <= b,
    "eq": lambda a, b: a == b,
    "ne": lambda a, b: a != b,
    "and": ca.logic_and,
    "or": ca.logic_or,
    "sum of angles": lambda a, b: ca.sin(a) * ca.cos(b) + ca.sin(a + b) - ca.cos(a + b),
    "sum of three": lambda a, b: ca.cos(a) + ca.sin(b) + ca.cos(a + b) + ca.sin(a + b + 1e-3 * a),
}
THREE: dict[str, Callable[[Any, Any, Any], Any]] = {
    "if else": lambda a, b, c: ca.if_else(a < b, b, c),
    "if else by value": lambda a, b, c: ca.if_else(a, b, c),
    "other way round": lambda a, b, c: ca.if_else(ca.logic_not(a < c), b, c),
    "nested": lambda a, b, c: ca.if_else(ca.logic_and(a < b, ca.logic_not(b <= c)), a, b + c),
    "masks as values": lambda a, b, c: (a < b) * c + (b < c) * (c <= a),
    "count of masks": lambda a, b, c: ca.if_else((a < b) + (b < c) + (c < a) < 2, a, c),
}
EXACT_ONE = ("neg", "twice", "fabs", "floor", "ceil", "sign", "sin", "cos", "tanh", "not")
EXACT_TWO = ("add", "sub", "lt", "le", "eq", "ne", "and", "or", "copysign")
NO_NUMBER_SAFE = (*EXACT_ONE, "mask of a mask", "one or zero", *EXACT_TWO, *THREE)
"""Those whose results are CasADi's for infinite arguments and NaN as well."""


def random_function(seed: int, among: Sequence[str] | None = None, size: int = 14) -> ca.Function:
    """A function ``(x, w, p) -> (a, b)`` of a few operations, which share their arguments."""
    rng = np.random.default_rng(seed)
    x, w, p = ca.SX.sym("x", INPUTS), ca.SX.sym("w"), ca.SX.sym("p", NUMBERS)
    values = [*ca.vertsplit(x), *ca.vertsplit(p), ca.SX(rng.uniform(-2, 2))]
    tables = [
        {k: v for k, v in t.items() if among is None or k in among} for t in (ONE, TWO, THREE)
    ]
    every = [(arity, name) for arity, table in enumerate(tables, 1) for name in table]
    for _ in range(size):
        arity, name = every[rng.integers(len(every))]
        near = np.maximum(len(values) - rng.geometric(0.25, arity), 0)
        anywhere = rng.integers(len(values), size=arity)
        picked = np.where(rng.random(arity) < 0.5, near, anywhere)
        operation: Any = tables[arity - 1][name]
        values.append(ca.SX(operation(*(values[i] for i in picked))))
    half = len(values) // 2
    a, b = sum(values[half:], w), ca.vertcat(*values[-3:])
    return build(f"random_{seed}", {"x": x, "w": w, "p": p}, {"a": a, "b": b})


def covering(count: int) -> list[ca.Function]:
    """Functions of one operation each, of every kind, and random ones of many."""
    x, w, p = ca.SX.sym("x", INPUTS), ca.SX.sym("w"), ca.SX.sym("p", NUMBERS)
    made = []
    for arity, table in enumerate((ONE, TWO, THREE), 1):
        for name, operation in table.items():
            of_tick, of_run, mixed = x[:arity], p[:arity], ca.vertcat(p[0], x[1:3])[:arity]
            columns = [operation(*ca.vertsplit(v)) for v in (of_tick, of_run, mixed)]
            outputs = {"a": columns[0], "b": ca.vertcat(*columns[1:], w)}
            words = "".join(letter for letter in name if letter.isalpha())
            made.append(build(f"{words}_{arity}", {"x": x, "w": w, "p": p}, outputs))
    return [*made, *(random_function(seed) for seed in range(count))]


class Evaluated(NamedTuple):
    """What a graph gives."""

    exact: np.ndarray
    """Its outputs, (entries, n)."""
    tolerance: np.ndarray
    """What some roundings in each operation do to them, (entries, n)."""
    doubtful: np.ndarray
    """Whether they may also turn a decision, (n,)."""


SAMPLES = 6
ROUNDING = 2.0**-50
"""Four units in the last place: the emitter's worst, tanh and quotients, have 2.5."""
MARGIN = 16.0
"""How much farther than the samples a result may lie."""


def evaluated(graph: Graph, inputs: Sequence[np.ndarray], seed: int = 0) -> Evaluated:
    """Evaluate a graph with NumPy, once as it is and some times with an error in each value."""
    rng = np.random.default_rng(seed)
    n = inputs[0].shape[1]
    doubtful = np.zeros(n, dtype=bool)
    found: list[np.ndarray] = []
    with np.errstate(all="ignore"):
        for node in graph.nodes:
            if node.op == "const":
                found.append(np.full((SAMPLES + 1, n), node.value))
            elif node.op == "input":
                which, entry = node.value  # type: ignore[misc]
                found.append(np.tile(inputs[which][entry], (SAMPLES + 1, 1)))
            else:
                given = [found[a] for a in node.args]
                for near in _thresholds(node.op, given):
                    spread = np.ptp(near, axis=0)
                    doubtful |= (spread > 0) & (abs(near).min(axis=0) <= MARGIN * spread)
                found.append(_perturbed(node.op, _value(node.op, given), rng))
        outputs = [found[i] for entries in graph.outputs for i in entries]
        spread = np.array([abs(v - v[0]).max(axis=0) for v in outputs])
        exact = np.array([v[0] for v in outputs])
    return Evaluated(exact, MARGIN * spread + 1e-300, doubtful)


_EXACT = ("neg", "twice", "fabs", "floor", "ceil", "sign", "fmin", "fmax", "copysign", "assign")
_EXACT += ("select", "if_else_zero", "fmod", "remainder", *COMPARISONS)


def _perturbed(op: str, value: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    if op in _EXACT:
        return value
    size = np.maximum(abs(value), 1.0) if op in ("sin", "cos") else abs(value)
    error = rng.uniform(-ROUNDING, ROUNDING, value.shape) * size
    error[0] = 0
    return value + np.where(np.isfinite(value), error, 0.0)


def _thresholds(op: str, given: list[np.ndarray]) -> list[np.ndarray]:
    """What an operation jumps at the zeros of."""
    if op in ("lt", "le", "eq", "ne"):
        return [given[0] - given[1]]
    if op in ("and", "or"):
        return given
    if op in ("not", "select", "if_else_zero", "sign"):
        return given[:1]
    if op == "copysign":
        return given[1:]
    if op in ("floor", "ceil"):
        return [given[0] - np.round(given[0][0])]
    if op == "atan2":
        return [np.where(given[1] < 0, given[0], np.hypot(*given))]
    if op in ("fmod", "remainder"):
        quotient = given[0] / given[1] + (0.5 if op == "remainder" else 0.0)
        return [quotient - np.round(quotient[0])]
    return []


_NUMPY: dict[str, Callable[..., np.ndarray]] = {
    "add": np.add,
    "sub": np.subtract,
    "mul": np.multiply,
    "div": np.divide,
    "neg": np.negative,
    "twice": lambda a: a + a,
    "sq": np.square,
    "inv": lambda a: 1 / a,
    "sqrt": np.sqrt,
    "pow": np.power,
    "constpow": np.power,
    "atan2": np.arctan2,
    "asin": np.arcsin,
    "acos": np.arccos,
    "atan": np.arctan,
    "asinh": np.arcsinh,
    "acosh": np.arccosh,
    "atanh": np.arctanh,
    "lt": np.less,
    "le": np.less_equal,
    "eq": np.equal,
    "ne": np.not_equal,
    "not": np.logical_not,
    "and": np.logical_and,
    "or": np.logical_or,
    "remainder": lambda a, b: a - b * np.rint(a / b),
    "erf": special.erf,
    "select": lambda m, yes, no: np.where(m != 0, yes, no),
    "if_else_zero": lambda m, value: np.where(m != 0, value, 0.0),
    "turned_sin": lambda x, s, c, turn: s * np.cos(turn) + c * np.sin(turn),
    "turned_cos": lambda x, s, c, turn: c * np.cos(turn) - s * np.sin(turn),
    "assign": lambda a: a,
}


def _value(op: str, given: list[np.ndarray]) -> np.ndarray:
    function = _NUMPY.get(op) or getattr(np, op)
    return np.asarray(function(*given), dtype=float)
