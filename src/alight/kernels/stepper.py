"""A sampled system advanced by one sample at a time, on arrays that stay where they are."""

from __future__ import annotations

import ctypes
import time
from collections.abc import Callable

import casadi as ca
import numpy as np

from alight.errors import UnknownName
from alight.kernels.compiled import FLAGS, c_of
from alight.kernels.compilers import CompilerUnavailable
from alight.kernels.direct import call_on
from alight.kernels.select import COMMON, Backend
from alight.kernels.toolchain import library_of, load, tell_once


class Stepper:
    """Runs ``(u, x, p) -> (x_next, y)`` in place: `step` reads ``u`` and ``p``, renews the rest.

    Parameters
    ----------
    function : casadi.Function
        Three dense inputs, columns; two dense outputs, the first as long as ``x``.
    backend : {"auto", "vm", "c"}
        ``auto`` is compiled C, and the virtual machine with one warning where that cannot be had.

    Raises
    ------
    UnknownName
        If the backend is not one of the three.
    CompilerUnavailable
        If ``c`` is asked for and cannot be had.
    """

    def __init__(self, function: ca.Function, backend: Backend = "auto") -> None:
        if backend not in COMMON:
            raise UnknownName("backend", backend, COMMON)
        sizes = [*(function.numel_in(i) for i in range(3)), function.numel_out(1)]
        self.block = np.zeros(sum(sizes))
        self.u, self.x, self.p, self.y = np.split(self.block, np.cumsum(sizes)[:-1])
        self.backend: Backend = "vm"
        self.step: Callable[[], None]
        """Advance by one sample."""
        if backend != "vm":
            try:
                self._use_c(function)
            except CompilerUnavailable as error:
                if backend == "c":
                    raise
                tell_once(f"steps in CasADi's virtual machine, several times slower: {error}")
        if self.backend == "vm":
            self._use_vm(function)

    def seconds_in_c(self, n: int) -> float:
        """Time [s] of ``n`` steps that do not return to Python; compiled steppers only."""
        began = time.perf_counter()
        self._repeat(self.block.ctypes.data, n)
        return time.perf_counter() - began

    def _use_c(self, function: ca.Function) -> None:
        source = c_of(function, "step.c")
        library = load(source, flags=FLAGS)
        self._repeat = library.alight_repeat
        self._repeat.restype = None
        self._repeat.argtypes = [ctypes.c_void_p, ctypes.c_longlong]
        external = ca.external("alight_step", str(library_of(source, flags=FLAGS)))
        self.step = call_on(external, [self.block], [])
        self.backend = "c"

    def _use_vm(self, function: ca.Function) -> None:
        x_next = np.zeros(len(self.x))
        evaluate = call_on(function, [self.u, self.x, self.p], [x_next, self.y])

        def step() -> None:
            evaluate()
            self.x[:] = x_next

        self.step = step
