"""Which backend runs a program."""

from __future__ import annotations

from typing import Literal

from alight.errors import UnknownName
from alight.kernels.auto import Auto
from alight.kernels.compiled import Compiled
from alight.kernels.program import Program, Runner
from alight.kernels.vm import VirtualMachine

Backend = Literal["auto", "vm", "c"]
BACKENDS: tuple[Backend, ...] = ("auto", "vm", "c")


def runner(program: Program, backend: Backend = "auto", ticks: int = 0) -> Runner:
    """Return what runs a program.

    Parameters
    ----------
    program : Program
        What is run.
    backend : {"auto", "vm", "c"}
        ``auto`` starts in the virtual machine and compiles when that costs less than going on;
        see `alight.kernels.auto.Auto`.
    ticks : int
        How many ticks will be run, if it is known: lets ``auto`` compile sooner.

    Raises
    ------
    UnknownName
        If the backend is not one of `BACKENDS`.
    CompilerUnavailable
        If ``c`` is asked for and cannot be had.
    """
    if backend not in BACKENDS:
        raise UnknownName("backend", backend, BACKENDS)
    if backend == "vm":
        return VirtualMachine(program)
    if backend == "c":
        return Compiled(program)
    made = Auto(program)
    made.expect(ticks)
    return made
