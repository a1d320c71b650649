"""Which backend runs a program."""

from __future__ import annotations

import warnings
from typing import Literal

from alight.errors import UnknownName
from alight.kernels.compiled import Compiled, CompilerUnavailable
from alight.kernels.program import Program, Runner
from alight.kernels.vm import VirtualMachine

Backend = Literal["auto", "vm", "c"]
BACKENDS: tuple[Backend, ...] = ("auto", "vm", "c")


def runner(program: Program, backend: Backend = "auto") -> Runner:
    """Return what runs a program.

    ``auto`` is compiled C where it can be had, else the virtual machine with one warning.

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
    try:
        return Compiled(program)
    except CompilerUnavailable as error:
        if backend == "c":
            raise
        warnings.warn(
            f"runs in CasADi's virtual machine, several times slower: {error}", stacklevel=3
        )
        return VirtualMachine(program)
