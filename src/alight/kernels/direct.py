"""Calling a CasADi function from Python without its argument handling."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np


class Direct:
    """A function on arrays of fixed size, called through buffers: microseconds, not tens of them.

    Each call returns fresh arrays, one for each output, flattened column by column.
    """

    def __init__(self, function: ca.Function) -> None:
        self._buffer, self._evaluate = function.buffer()
        self._inputs = [np.zeros(function.numel_in(i)) for i in range(function.n_in())]
        self._outputs = [np.zeros(function.numel_out(i)) for i in range(function.n_out())]
        for i, array in enumerate(self._inputs):
            self._buffer.set_arg(i, memoryview(array))  # type: ignore[call-arg, arg-type]
        for i, array in enumerate(self._outputs):
            self._buffer.set_res(i, memoryview(array))  # type: ignore[call-arg, arg-type]

    def __call__(self, *args: Any) -> list[np.ndarray]:
        """Evaluate at one value for each input."""
        for array, value in zip(self._inputs, args, strict=True):
            array[:] = value
        self._evaluate()
        return [array.copy() for array in self._outputs]
