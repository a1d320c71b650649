"""Which backend runs a program."""

from __future__ import annotations

from typing import Literal

from alight.errors import UnknownName
from alight.kernels.auto import Auto
from alight.kernels.compiled import Compiled
from alight.kernels.lanes.single import SingleLane
from alight.kernels.program import Program, Runner
from alight.kernels.vm import VirtualMachine

Backend = Literal["auto", "vm", "c", "lanes"]
BACKENDS: tuple[Backend, ...] = ("auto", "vm", "c", "lanes")
COMMON: tuple[Backend, ...] = BACKENDS[:3]
"""Those that a single tick and a batch know, too: a batch runs in lanes anyway."""


def runner(program: Program, backend: Backend = "auto", ticks: int = 0) -> Runner:
    """Return what runs a program.

    Parameters
    ----------
    program : Program
        What is run.
    backend : {"auto", "vm", "c", "lanes"}
        ``auto`` starts in the virtual machine and compiles when that costs less than going on;
        see `alight.kernels.auto.Auto`. ``c`` gives the bits of the virtual machine; ``lanes`` is
        faster and gives those of a batch.
    ticks : int
        How many ticks will be run, if it is known: lets ``auto`` compile sooner.

    Raises
    ------
    UnknownName
        If the backend is not one of `BACKENDS`.
    CompilerUnavailable
        If ``c`` or ``lanes`` is asked for and cannot be had.
    """
    if backend not in BACKENDS:
        raise UnknownName("backend", backend, BACKENDS)
    if backend == "vm":
        return VirtualMachine(program)
    if backend == "c":
        return Compiled(program)
    if backend == "lanes":
        return SingleLane(program)
    made = Auto(program)
    made.expect(ticks)
    return made
