"""A loop at given coordinates in plain numbers, for what is no expression: solvers and runs."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np

from alight.control import AdaptiveState
from alight.models import PlantState
from alight.symbolic.parameters import is_parameters, rebind
from alight.theory.falsification.judged import Expressions
from alight.theory.falsification.loop import Loop
from alight.theory.falsification.space import Columns


def numeric(made: Callable[[Expressions], Loop], columns: Columns, i: int) -> Loop:
    """The loop of one try; its law starts with the filter and the estimates of that state."""
    loop = made({name: ca.SX(float(column[i])) for name, column in columns.items()})
    s = PlantState(*(_value(part) for part in loop.s))
    a = AdaptiveState(*(_value(part) for part in loop.a))
    law: Any = _numbers(loop.law)
    law = rebind(
        law,
        e_f=float(np.arctanh(a.u_f)),
        theta_dk=rebind(law.theta_dk, initial=a.theta_dk_hat),
        theta_r=rebind(law.theta_r, initial=tuple(a.theta_r_hat)),
    )
    return Loop(law, s, a)


def _numbers(obj: Any) -> Any:
    fields = {f.name: getattr(obj, f.name) for f in dataclasses.fields(obj)}
    return rebind(obj, **{name: _number(value) for name, value in fields.items()})


def _number(value: Any) -> Any:
    if is_parameters(value):
        return _numbers(value)
    plain = _value(value)
    return tuple(plain) if isinstance(plain, np.ndarray) else plain


def _value(value: Any) -> Any:
    """A float or an array in place of a constant expression."""
    if not isinstance(value, ca.SX):
        return value
    column = np.asarray(ca.evalf(value))[:, 0]
    return float(column[0]) if column.size == 1 else column
