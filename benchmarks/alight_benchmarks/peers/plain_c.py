"""The unit of every ratio: Alight's own expressions as scalar C, looped in C, and nothing more."""

from __future__ import annotations

import ctypes
import tempfile
from pathlib import Path

import numpy as np

from alight_benchmarks.peer import RECORD_EVERY, Peer, Problem, Run

LOOP = """
void run(long long n, long long every, double* x, const double* p, double* rows) {
  const double* arg[SZ_ARG];
  double* res[SZ_RES];
  casadi_int iw[SZ_IW];
  double w[SZ_W], next[N_X], before[3] = {x[0], x[1], x[4]}, seen[3];
  long long k, i;
  for (k = 0; k < n; ++k) {
    if (k % every == 0) {
      *rows++ = x[0];
      *rows++ = x[1];
      *rows++ = x[4];
    }
    arg[0] = x;
    arg[1] = before;
    arg[2] = p;
    res[0] = next;
    res[1] = seen;
    tick(arg, res, iw, w, 0);
    for (i = 0; i < N_X; ++i) x[i] = next[i];
    for (i = 0; i < 3; ++i) before[i] = seen[i];
  }
}
"""


def _prepare(problem: Problem) -> Run:
    from alight_benchmarks.generated import library_of, source_of, start_of, tick_of

    tick, numbers = tick_of(problem.scenario)
    start = start_of(problem.scenario)
    source = "\n".join([source_of(tick), f"#define N_X {len(start)}", LOOP])
    with tempfile.TemporaryDirectory() as folder:
        loop = ctypes.CDLL(str(library_of(source, Path(folder)))).run
    doubles = np.ctypeslib.ndpointer(dtype=np.float64, flags="C_CONTIGUOUS")
    loop.argtypes = [ctypes.c_longlong, ctypes.c_longlong, doubles, doubles, doubles]
    loop.restype = None

    def run() -> np.ndarray:
        rows = np.empty((len(problem.times), 3))
        loop(problem.ticks, RECORD_EVERY, start.copy(), numbers, rows)
        return rows

    return run


PEERS = (
    Peer(
        name="C, scalar (R)",
        package="casadi",
        how="sampled law and Runge-Kutta plant, Alight's expressions as scalar C at -O3",
        prepare=_prepare,
    ),
)
REFERENCE = PEERS[0]
"""The unit of every ratio, R."""
