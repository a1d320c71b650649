"""The tick as C, compiled by the compiler found and kept by content in the user's cache folder."""

from __future__ import annotations

import ctypes
from importlib import resources

import casadi as ca
import numpy as np

from alight.kernels.direct import Direct
from alight.kernels.program import Program
from alight.kernels.toolchain import load

FLAGS = ("-O2", "-fvisibility=hidden", "-ffp-contract=off", "-fno-math-errno")
"""The virtual machine's bits, and nothing slower: -O3 or the present processor gain nothing here.

Without contraction each operation is rounded by itself, as CasADi's virtual machine does.
"""


def c_of(function: ca.Function, after: str) -> str:
    """C of a function, the sizes of its work space as macros, and the file that calls it.

    Parameters
    ----------
    function : casadi.Function
        Inputs and outputs are dense.
    after : str
        Name of a C file of this package, which calls ``ALIGHT_TICK``.
    """
    generator = ca.CodeGenerator("tick.c", {"with_header": False, "verbose": False})
    generator.add(function)
    sizes = {
        "TICK": function.name(),
        "SZ_ARG": function.sz_arg(),
        "SZ_RES": function.sz_res(),
        "SZ_IW": max(function.sz_iw(), 1),
        "SZ_W": max(function.sz_w(), 1),
        "EXPORT": '__attribute__((visibility("default")))',
        **{f"N_IN{i}": function.numel_in(i) for i in range(function.n_in())},
        **{f"N_OUT{i}": function.numel_out(i) for i in range(function.n_out())},
    }
    defines = "\n".join(f"#define ALIGHT_{name} {value}" for name, value in sizes.items())
    # A global name of the process, such as tick, would be called instead of ours.
    private = "#define CASADI_SYMBOL_EXPORT static"
    return "\n".join([private, generator.dump(), defines, _text(after)])


def _text(name: str) -> str:
    return resources.files("alight.kernels").joinpath(name).read_text("utf-8")


def source_of(program: Program) -> str:
    """C source of the tick and of the loop that runs it."""
    return c_of(program.tick, "loop.c")


class Compiled:
    """Runs a program as compiled C.

    Raises
    ------
    CompilerUnavailable
        If it cannot be compiled or loaded.
    """

    name = "c"

    def __init__(self, program: Program) -> None:
        library = load(source_of(program), flags=FLAGS)
        self._n_y = program.tick.numel_out(1)
        self._once = Direct(program.once)
        self._run = library.alight_run
        doubles = np.ctypeslib.ndpointer(dtype=np.float64, flags="C_CONTIGUOUS")
        self._run.restype = ctypes.c_longlong
        self._run.argtypes = [ctypes.c_longlong, doubles, doubles, doubles, doubles]

    def run(self, x: np.ndarray, w: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Run as many ticks as ``w`` has entries; see `Runner`."""
        state = np.array(x, dtype=np.float64)
        y = np.empty((len(w), self._n_y))
        noise = np.ascontiguousarray(w, dtype=np.float64)
        done = self._run(len(w), state, noise, self._once(p)[0], y)
        return state, y[:done]
