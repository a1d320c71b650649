"""One function per property: built once on symbols, tried at many numbers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import casadi as ca
import numpy as np

from alight.symbolic.build import build
from alight.symbolic.parameters import lift, values_of

Evaluate = Callable[..., dict[str, np.ndarray]]


def lifted(
    template: Any, sizes: Mapping[str, int], expressions: Callable[..., Mapping[str, Any]]
) -> Evaluate:
    """Build ``expressions(parameters, *arguments)`` once, to be called with numbers.

    ``template`` is any parameter set of the structure that will be given; ``sizes`` holds the
    number of entries of each argument.
    """
    symbolic = lift(template)
    arguments = {name: ca.SX.sym(name, size) for name, size in sizes.items()}
    outputs = expressions(symbolic.obj, *arguments.values())
    function = build("property", {"parameters": symbolic.symbols, **arguments}, dict(outputs))

    def evaluate(parameters: Any, *values: Any) -> dict[str, np.ndarray]:
        found = function.call([values_of(parameters), *values])
        shaped = [v.full() for v in found]
        return {
            name: v[:, 0] if v.shape[1] == 1 else v for name, v in zip(outputs, shaped, strict=True)
        }

    return evaluate
