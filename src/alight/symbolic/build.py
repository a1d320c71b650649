"""From expressions to a function with a fixed layout, refused where it would hide a mistake."""

from __future__ import annotations

import casadi as ca
import numpy as np

from alight.errors import ExpressionError


def build(name: str, inputs: dict[str, ca.SX], outputs: dict[str, ca.SX]) -> ca.Function:
    """Build a function of the named inputs; common subexpressions are shared.

    Raises
    ------
    ExpressionError
        If the graph holds a NaN or infinite constant, or depends on a symbol that is no input.
    """
    names = list(outputs)
    shared = ca.cse([ca.densify(ca.SX(outputs[n])) for n in names])
    given = {s.element_hash() for column in inputs.values() for s in ca.symvar(column)}
    free = {s.name() for e in shared for s in ca.symvar(e) if s.element_hash() not in given}
    if free:
        raise ExpressionError(f"{name}: depends on {', '.join(sorted(free))}, which is no input")
    function = ca.Function(name, list(inputs.values()), shared, list(inputs), names)
    constants = [
        function.instruction_constant(i)
        for i in range(function.n_instructions())
        if function.instruction_id(i) == ca.OP_CONST
    ]
    if not np.all(np.isfinite(constants)):
        raise ExpressionError(
            f"{name}: the graph holds a constant that is not finite; use the functions of "
            "alight.symbolic.ops instead of those of math or numpy"
        )
    return function
