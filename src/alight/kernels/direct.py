"""Calling a CasADi function from Python without its argument handling."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from typing import Any

import casadi as ca
import numpy as np


def call_on(
    function: ca.Function, inputs: Sequence[np.ndarray], outputs: Sequence[np.ndarray]
) -> Callable[[], None]:
    """Bind a function to arrays: each call reads the inputs and fills the outputs.

    Parameters
    ----------
    function : casadi.Function
        What is called.
    inputs, outputs : sequence of (n,) float arrays
        One for each input and output, column by column; they are used where they lie.
    """
    buffer, evaluate = function.buffer()
    for i, array in enumerate(inputs):
        buffer.set_arg(i, memoryview(array))  # type: ignore[call-arg, arg-type]
    for i, array in enumerate(outputs):
        buffer.set_res(i, memoryview(array))  # type: ignore[call-arg, arg-type]
    # The callable holds bare addresses: whoever holds it must hold what they point at, too.
    evaluate.held = (buffer, function, *inputs, *outputs)
    return evaluate


class Direct:
    """A function on arrays of fixed size, called through buffers: microseconds, not tens of them.

    Each call returns fresh arrays, one for each output, flattened column by column. Threads take
    turns.
    """

    def __init__(self, function: ca.Function) -> None:
        self._inputs = [np.zeros(function.numel_in(i)) for i in range(function.n_in())]
        self._outputs = [np.zeros(function.numel_out(i)) for i in range(function.n_out())]
        self._evaluate = call_on(function, self._inputs, self._outputs)
        # Two threads that evaluated it at once would read one another's arrays.
        self._one_at_a_time = threading.Lock()

    def __call__(self, *args: Any) -> list[np.ndarray]:
        """Evaluate at one value for each input."""
        with self._one_at_a_time:
            for array, value in zip(self._inputs, args, strict=True):
                array[:] = value
            self._evaluate()
            return [array.copy() for array in self._outputs]
