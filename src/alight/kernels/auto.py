"""The backend that compiles when the work is worth it."""

from __future__ import annotations

import os
import time

import numpy as np

from alight.kernels.compiled import FLAGS, Compiled, source_of
from alight.kernels.compilers import CompilerUnavailable
from alight.kernels.program import Program, Runner
from alight.kernels.toolchain import is_kept, tell_once
from alight.kernels.vm import VirtualMachine

COMPILED_PER_SECOND = 1e5
"""Characters of C that a compiler turns into a library in a second, roughly."""
TRIAL = 1024
"""Ticks after which it is known how long a tick takes."""


class Auto:
    """Runs a program in the virtual machine until compiling it costs less than going on.

    A program that was compiled before, in whatever process, is compiled C from the start. The two
    give the same bits, so that a run may change over in its midst. Where compiling fails, one
    warning in the process says what was lost.
    """

    name = "auto"

    def __init__(self, program: Program) -> None:
        self._program = program
        self._source = source_of(program)
        self._made: Runner | None = None
        self._spent, self._done, self._ahead = 0.0, 0, 0
        if is_kept(self._source, flags=FLAGS):
            self._compile()

    def expect(self, ticks: int) -> None:
        """Take notice that so many ticks will be run from now on."""
        self._ahead = ticks

    @property
    def compiled(self) -> bool:
        """Whether what follows runs as compiled C."""
        return isinstance(self._made, Compiled)

    def run(self, x: np.ndarray, w: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Run as many ticks as ``w`` has entries; see `Runner`."""
        if self.compiled or len(w) <= TRIAL:
            return self._run(x, w, p)
        x, first = self._run(x, w[:TRIAL], p)
        if len(first) < TRIAL or first[-1, -1] or not np.isfinite(first[-1]).all():
            return x, first
        self._ahead = max(self._ahead, len(w) - TRIAL)
        x, rest = self._run(x, w[TRIAL:], p)
        return x, np.concatenate([first, rest])

    def _run(self, x: np.ndarray, w: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        if not self.compiled and self._worth_compiling():
            self._compile()
        if self._made is None:
            self._made = VirtualMachine(self._program)
        began = time.perf_counter()
        x, y = self._made.run(x, w, p)
        self._spent += time.perf_counter() - began
        self._done += len(y)
        self._ahead = max(self._ahead - len(w), 0)
        return x, y

    def _worth_compiling(self) -> bool:
        """Whether the virtual machine has cost, or is about to cost, more than compiling would."""
        if _surroundings() in _in_vain or not self._done:
            return False
        work = self._spent * (1 + self._ahead / self._done)
        compiling = len(self._source) / COMPILED_PER_SECOND
        return work > compiling

    def _compile(self) -> None:
        try:
            self._made = Compiled(self._program)
        except CompilerUnavailable as error:
            _in_vain.add(_surroundings())
            tell_once(f"runs in CasADi's virtual machine, several times slower: {error}")


_in_vain: set[tuple[str | None, ...]] = set()
"""Surroundings in which compiling has failed: it is not tried again for each program."""


def _surroundings() -> tuple[str | None, ...]:
    return tuple(os.environ.get(name) for name in ("CC", "PATH", "XDG_CACHE_HOME", "HOME"))
