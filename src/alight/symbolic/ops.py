"""Mathematical functions that take floats, NumPy arrays and CasADi expressions alike.

``math.sin`` and ``numpy.sin`` of an SX give NaN or an object array without a word; equations
therefore import their functions from here only.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import casadi as ca
import numpy as np

Scalar = Any
"""A float or a 1x1 SX."""
Vector = Any
"""An array of shape (n,) or an n x 1 SX."""
Matrix = Any
"""An array of shape (n, m) or an n x m SX."""


def is_symbolic(*values: Any) -> bool:
    """Whether any of the values is, or holds, a CasADi expression."""
    return any(
        isinstance(v, ca.SX) or (isinstance(v, (tuple, list)) and is_symbolic(*v)) for v in values
    )


def _elementwise(symbolic: Callable[..., ca.SX], numeric: Callable[..., Any]) -> Callable[..., Any]:
    def function(*args: Any) -> Any:
        return symbolic(*args) if is_symbolic(*args) else numeric(*args)

    function.__name__ = function.__qualname__ = numeric.__name__
    function.__doc__ = f"Elementwise {numeric.__name__} of floats, arrays or expressions."
    return function


sin = _elementwise(ca.sin, np.sin)
cos = _elementwise(ca.cos, np.cos)
tanh = _elementwise(ca.tanh, np.tanh)
arccos = _elementwise(ca.acos, np.arccos)
arctan2 = _elementwise(ca.atan2, np.arctan2)
exp = _elementwise(ca.exp, np.exp)
log1p = _elementwise(ca.log1p, np.log1p)
sqrt = _elementwise(ca.sqrt, np.sqrt)
floor = _elementwise(ca.floor, np.floor)
fabs = _elementwise(ca.fabs, np.fabs)
sign = _elementwise(ca.sign, np.sign)
maximum = _elementwise(ca.fmax, np.maximum)
minimum = _elementwise(ca.fmin, np.minimum)


def where(condition: Any, if_true: Any, if_false: Any) -> Any:
    """Choose elementwise; both branches are evaluated, and the jump has derivative zero."""
    if is_symbolic(condition):
        return ca.if_else(condition, if_true, if_false)
    if is_symbolic(if_true, if_false):  # decided already: nothing of the other branch remains
        return if_true if condition else if_false
    return np.where(condition, if_true, if_false)[()]


def log_cosh(x: Any) -> Any:
    """ln(cosh(x)) in a form that cannot overflow."""
    return fabs(x) + log1p(exp(-2 * fabs(x))) - float(np.log(2.0))


def vector(*entries: Scalar) -> Vector:
    """A column of scalars."""
    return ca.vertcat(*entries) if is_symbolic(*entries) else np.array(entries, dtype=float)


def as_vector(value: Any) -> Vector:
    """A tuple, list or array as a vector; an expression as it is."""
    if isinstance(value, ca.SX):
        return value
    return vector(*value) if is_symbolic(value) else np.asarray(value, dtype=float)


def as_expression(value: Any) -> ca.SX:
    """Numbers as a constant expression; an expression as it is."""
    return value if isinstance(value, ca.SX) else ca.SX(ca.DM(np.asarray(value, dtype=float)))


def matrix(rows: Sequence[Sequence[Scalar]]) -> Matrix:
    """A matrix given by its rows."""
    if is_symbolic(*(entry for row in rows for entry in row)):
        return ca.vertcat(*(ca.horzcat(*row) for row in rows))
    return np.array(rows, dtype=float)


def concatenate(*parts: Any) -> Vector:
    """Scalars and vectors joined to one vector."""
    if is_symbolic(*parts):
        return ca.vertcat(*parts)
    return np.concatenate([np.zeros(0), *(np.atleast_1d(np.asarray(p, float)) for p in parts)])


def inverse(a: Matrix) -> Matrix:
    """Inverse of a small matrix (by minors where symbolic)."""
    return ca.inv_minor(a) if is_symbolic(a) else np.linalg.inv(a)


def determinant(a: Matrix) -> Scalar:
    """Determinant of a square matrix."""
    return ca.det(a) if is_symbolic(a) else float(np.linalg.det(a))


def dot(a: Vector, b: Vector) -> Scalar:
    """Inner product of two vectors."""
    return ca.dot(a, b) if is_symbolic(a, b) else float(np.dot(a, b))


def total(a: Vector) -> Scalar:
    """Sum of the entries of a vector."""
    return ca.sum1(a) if is_symbolic(a) else float(np.sum(a))
