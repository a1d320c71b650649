"""What one core can do at most: chains of operations that do not wait for one another."""

from __future__ import annotations

import ctypes
import time
from functools import cache
from importlib import resources

from alight.kernels.toolchain import load

FLAGS = ("-O2", "-march=native", "-ffp-contract=off")
CHAINS = 12
"""More than two units of four cycles each need, fewer than there are registers."""
SOURCE = """
#define EACH(do) do(0) do(1) do(2) do(3) do(4) do(5) do(6) do(7) do(8) do(9) do(10) do(11)
#define MAKE(i) V a##i = v_set(1.0 + i);
#define FUSE(i) a##i = v_fma(a##i, m, c);
#define MIX(i) a##i = i % 2 ? a##i * m : a##i + c;
#define SUM(i) sum = sum + a##i;
#define LOOP(name, op)                     \\
  double name(long long n) {               \\
    const V m = v_set(1 - 1e-9), c = v_set(1e-9); \\
    V sum = v_set(0.0);                    \\
    EACH(MAKE)                             \\
    while (n-- > 0) { EACH(op) }           \\
    EACH(SUM)                              \\
    return v_get(sum, 0);                  \\
  }
LOOP(fused, FUSE)
LOOP(mixed, MIX)
int lanes(void) { return LANES; }
"""


@cache
def _library() -> ctypes.CDLL:
    header = resources.files("alight.kernels.lanes").joinpath("vector.h").read_text("utf-8")
    library = load(header + SOURCE, flags=FLAGS)
    for name in ("fused", "mixed"):
        function = getattr(library, name)
        function.argtypes, function.restype = [ctypes.c_longlong], ctypes.c_double
    return library


def lanes() -> int:
    """Doubles in a vector register that the compiler uses."""
    return _library().lanes()


def peak(seconds: float) -> dict[str, float]:
    """Most operations in a second on one core: multiply-adds (two each), and single ones."""
    return {
        "fused_flops": 2 * _rate(_library().fused, seconds),
        "single_flops": _rate(_library().mixed, seconds),
    }


def _rate(function: ctypes._NamedFuncPointer, seconds: float) -> float:
    """Operations of all lanes in a second; the best of some samples."""
    n, best = 1_000_000, 0.0
    until = time.perf_counter() + seconds
    while not best or time.perf_counter() < until:
        began = time.perf_counter()
        function(n)
        best = max(best, n * CHAINS * lanes() / (time.perf_counter() - began))
    return best
