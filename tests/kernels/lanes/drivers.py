"""Functions over lanes, compiled and called with arrays of eight runs in every width."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence
from functools import cache
from importlib import resources

import numpy as np

from alight.kernels.lanes.source import HEADERS
from alight.kernels.toolchain import load

WIDTHS = (1, 2, 4, 8)
RUNS = 8
NATIVE = ("-O1", "-march=native", "-ffp-contract=fast", "-fno-math-errno", "-fno-trapping-math")
"""Flags of the batch, but for how hard the compiler tries."""
POINTER = ctypes.POINTER(ctypes.c_double)


def header(name: str) -> str:
    """Text of one of the headers."""
    return resources.files("alight.kernels.lanes").joinpath(name).read_text("utf-8")


def driver(bodies: Mapping[str, Sequence[str]]) -> str:
    """C of functions ``(x, p, out)`` over arrays of vectors, each from its lines."""
    includes = {f'#include "{name}"' for name in HEADERS}
    lines = [line for name in HEADERS for line in header(name).splitlines() if line not in includes]
    for name, body in bodies.items():
        lines += [
            f"void call_{name}(const double *x_, const double *p, double *out_) {{",
            "  const V *x = (const V *)x_;",
            "  V *out = (V *)out_;",
            "  (void)x, (void)p;",
            *(f"  {line}" for line in body),
            "}",
        ]
    return "\n".join(lines)


@cache
def library(source: str, width: int, flags: tuple[str, ...] = NATIVE) -> ctypes.CDLL:
    """The functions in one width."""
    return load(source, flags=(*flags, f"-DALIGHT_LANES={width}"))


def call(
    made: ctypes.CDLL, name: str, width: int, x: np.ndarray, p: np.ndarray, outputs: int
) -> np.ndarray:
    """Results (outputs, n) of a function for arguments (entries, n), ``width`` at a time."""
    columns = []
    for first in range(0, x.shape[1], width):
        given = [_aligned(v[:, first : first + width]) for v in (x, p)]
        out = _aligned(np.zeros((outputs, width)))
        getattr(made, f"call_{name}")(*(v.ctypes.data_as(POINTER) for v in (*given, out)))
        columns.append(out.copy())
    return np.concatenate(columns, axis=1)


def _aligned(values: np.ndarray) -> np.ndarray:
    raw = np.zeros(values.size + 8)
    start = -raw.ctypes.data % 64 // 8
    made = raw[start : start + values.size].reshape(values.shape)
    made[...] = values
    return made


def same(a: np.ndarray, b: np.ndarray) -> bool:
    """Equal to the bit, but for the bits of NaN."""
    nan = np.isnan(a) & np.isnan(b)
    return bool(np.all(nan | (a.view(np.uint64) == b.view(np.uint64))))
