"""The tick as C, compiled by the compiler found and kept by content in the user's cache folder."""

from __future__ import annotations

import ctypes
import hashlib
import os
import shutil
import subprocess
import sys
import tempfile
from functools import cache
from importlib import resources
from pathlib import Path

import casadi as ca
import numpy as np

from alight.errors import AlightError
from alight.kernels.program import Program

COMPILERS = ("cc", "gcc", "clang")
FLAGS = ("-O2", "-fPIC", "-shared", "-ffp-contract=off", "-fno-math-errno")


class CompilerUnavailable(AlightError):
    """No working C compiler, or no folder to keep its output in."""


def cache_folder() -> Path:
    """Folder for compiled programs: ``alight`` in the user's cache folder."""
    if sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return base / "alight"


@cache
def find_compiler() -> str:
    """Path of a C compiler.

    Raises
    ------
    CompilerUnavailable
        If none of `COMPILERS` is on the path.
    """
    for name in filter(None, (os.environ.get("CC"), *COMPILERS)):
        if path := shutil.which(name):
            return path
    raise CompilerUnavailable(f"no C compiler ({', '.join(COMPILERS)}) is on the path")


@cache
def _compiler_version(compiler: str) -> str:
    try:
        done = subprocess.run(
            [compiler, "--version"], capture_output=True, text=True, timeout=60, check=False
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise CompilerUnavailable(f"{compiler} does not run: {error}") from None
    return done.stdout + os.uname().machine


def source_of(program: Program) -> str:
    """C source of the tick and of the loop that runs it."""
    tick = program.tick
    generator = ca.CodeGenerator("tick.c", {"with_header": False, "verbose": False})
    generator.add(tick)
    sizes = {
        "SZ_ARG": tick.sz_arg(),
        "SZ_RES": tick.sz_res(),
        "SZ_IW": max(tick.sz_iw(), 1),
        "SZ_W": max(tick.sz_w(), 1),
        "NX": tick.numel_in(0),
        "NY": tick.numel_out(1),
    }
    defines = "\n".join(f"#define ALIGHT_{name} {value}" for name, value in sizes.items())
    export = "#define ALIGHT_EXPORT CASADI_SYMBOL_EXPORT"
    loop = resources.files("alight.kernels").joinpath("loop.c").read_text("utf-8")
    return "\n".join([generator.dump(), defines, export, loop])


def library_of(source: str) -> Path:
    """Compile a source once, and return the library; concurrent builds do not disturb each other.

    Raises
    ------
    CompilerUnavailable
        If it cannot be compiled, or the cache folder cannot be written.
    """
    compiler = find_compiler()
    content = "\0".join([source, *FLAGS, compiler, _compiler_version(compiler)])
    target = cache_folder() / f"{hashlib.sha256(content.encode()).hexdigest()[:32]}.so"
    if target.exists():
        return target
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=target.parent) as folder:
            code, built = Path(folder, "tick.c"), Path(folder, "tick.so")
            code.write_text(source, "utf-8")
            command = [compiler, *FLAGS, str(code), "-o", str(built), "-lm"]
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            if done.returncode:
                raise CompilerUnavailable(f"{compiler} failed: {done.stderr.strip()[:400]}")
            os.replace(built, target)
    except OSError as error:
        raise CompilerUnavailable(f"cannot build in {target.parent}: {error}") from None
    return target


class Compiled:
    """Runs a program as compiled C."""

    name = "c"

    def __init__(self, program: Program) -> None:
        path = library_of(source_of(program))
        try:
            library = ctypes.CDLL(str(path))
        except OSError as error:
            raise CompilerUnavailable(f"{error}; remove it, or allow programs there") from None
        self._n_y = program.tick.numel_out(1)
        self._run = library.alight_run
        doubles = np.ctypeslib.ndpointer(dtype=np.float64, flags="C_CONTIGUOUS")
        self._run.restype = ctypes.c_longlong
        self._run.argtypes = [ctypes.c_longlong, doubles, doubles, doubles, doubles]

    def run(self, x: np.ndarray, w: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Run as many ticks as ``w`` has entries; see `Runner`."""
        state = np.array(x, dtype=np.float64)
        y = np.empty((len(w), self._n_y))
        noise, parameters = (np.ascontiguousarray(v, dtype=np.float64) for v in (w, p))
        done = self._run(len(w), state, noise, parameters, y)
        return state, y[:done]
