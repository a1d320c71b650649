"""The compiled batch: a group of runs side by side, one in each lane."""

from __future__ import annotations

import ctypes
import platform
from collections.abc import Sequence

import casadi as ca
import numpy as np

from alight.kernels.lanes.source import source_of
from alight.kernels.program import Group, Program
from alight.kernels.toolchain import load

FLAGS = (
    "-O2",
    "-march=native",
    "-fvisibility=hidden",
    "-ffp-contract=fast",
    "-fno-math-errno",
    "-fno-trapping-math",
    *(("-mtune=haswell",) if platform.machine() in ("x86_64", "AMD64") else ()),
)
"""What lets lanes be as wide as the processor's, and a product and a sum be one operation.

For a processor that is newer than the compiler, ``native`` would tune for the oldest of its kind.
"""
ALIGNMENT = 64


class _Batch(ctypes.Structure):
    """``Batch`` of ``batch.c``."""

    _fields_ = [
        *((name, ctypes.c_longlong) for name in ("ticks", "first", "every", "noise_stride")),
        *(
            (name, ctypes.c_void_p)
            for name in ("p", "noise", "x", "memory", "alive", "done", "trip", "rows")
        ),
    ]


class Lanes:
    """Runs a program with its metrics in groups of as many runs as the processor has lanes.

    Parameters
    ----------
    program : Program
        The tick.
    fold : casadi.Function
        ``(memory, y, k, settings) -> memory_next`` of its signals.
    recorded : sequence of int
        Entries of the signals that are recorded.
    width : int, optional
        Lanes to use, 1, 2, 4 or 8; those of the processor if absent.

    Raises
    ------
    CompilerUnavailable
        If it cannot be compiled.
    """

    name = "c"
    parallel = True

    def __init__(
        self,
        program: Program,
        fold: ca.Function,
        recorded: Sequence[int] = (),
        width: int | None = None,
    ) -> None:
        flags = FLAGS if width is None else (*FLAGS, f"-DALIGHT_LANES={width}")
        library = load(source_of(program, fold, recorded), flags=flags)
        self.width: int = library.alight_lanes()
        self._run = library.alight_batch
        self._run.argtypes, self._run.restype = [ctypes.POINTER(_Batch)], None
        self._recorded = len(recorded)

    def run(self, group: Group, first: int, noise: np.ndarray, every: int) -> np.ndarray:
        """Advance a group by as many ticks as ``noise`` has rows; see `GroupRunner`."""
        ticks = len(noise)
        rows = aligned((recorded_in(first, ticks, every), self._recorded, self.width))
        wide = aligned_like(noise)
        at = _Batch(
            ticks,
            first,
            every,
            noise.shape[1],
            *(a.ctypes.data for a in (group.p, wide)),
            *(a.ctypes.data for a in (group.x, group.memory, group.alive, group.done, group.trip)),
            rows.ctypes.data if self._recorded else None,
        )
        self._run(ctypes.byref(at))
        return rows

    def group(self, x: np.ndarray, p: np.ndarray, memory: np.ndarray) -> Group:
        """Lay out up to ``width`` runs, one column each; a lane without a run repeats the last."""
        columns = np.minimum(np.arange(self.width), x.shape[1] - 1)
        return Group(
            x=aligned_like(x[:, columns]),
            p=aligned_like(p[:, columns]),
            memory=aligned_like(np.repeat(memory[:, None], self.width, axis=1)),
            alive=aligned_like(np.ones(self.width)),
            done=aligned((self.width,)),
            trip=aligned((self.width,)),
        )


def recorded_in(first: int, ticks: int, every: int) -> int:
    """How many ticks from ``first`` on are recorded: those whose number ``every`` divides."""
    return -(-(first + ticks) // every) - -(-first // every)


def aligned(shape: tuple[int, ...]) -> np.ndarray:
    """Zeros whose first one stands at a multiple of `ALIGNMENT`."""
    size = int(np.prod(shape)) * 8
    raw = np.zeros(size + ALIGNMENT, dtype=np.uint8)
    start = -raw.ctypes.data % ALIGNMENT
    return raw[start : start + size].view(np.float64).reshape(shape)


def aligned_like(values: np.ndarray) -> np.ndarray:
    """A copy whose first entry stands at a multiple of `ALIGNMENT`."""
    made = aligned(values.shape)
    made[...] = values
    return made
