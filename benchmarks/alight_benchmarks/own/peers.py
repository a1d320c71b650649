"""Every peer on the same closed loop, as a multiple of the plain C, with its error."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

import alight
from alight.simulation.sampled_reference import sampled_reference
from alight_benchmarks.generated import NoCompiler
from alight_benchmarks.own.bench import Bench
from alight_benchmarks.own.ratios import Kept, Work, compared
from alight_benchmarks.peer import RECORD_EVERY, Peer, Problem, problem_scenario
from alight_benchmarks.peers import ALL
from alight_benchmarks.peers.plain_c import REFERENCE

SHOWN = 0.3
"""Length of the part over which errors are shown [s]: it holds the impacts."""
STRADDLING = 1e-4
"""More than what four plain steps lose in that time to those that straddle a switch [rad, m]."""


def measure(bench: Bench) -> dict[str, Any]:
    """Time and error of each peer; of one that is missing, what to install."""
    chosen = [peer for peer in ALL if peer is REFERENCE or peer.package in bench.tools]
    rows = []
    for i, peer in enumerate(chosen):
        bench.report(i / len(chosen), peer.name)
        rows.append({"place": i, **_described(peer), **measured(bench, peer)})
    rows.sort(key=lambda row: (row["batch"] > 1, row.get("ratio", {}).get("median", np.inf)))
    return {"rows": rows, "shown": SHOWN}


def _described(peer: Peer) -> dict[str, Any]:
    return {
        "name": peer.name,
        "how": peer.how,
        "package": peer.package,
        "version": peer.version,
        "loop": "continuous" if peer.continuous else "sampled",
        "batch": peer.batch,
    }


def measured(bench: Bench, peer: Peer) -> dict[str, Any]:
    """Ratio and error of a peer, or why there are none."""
    if peer.version is None:
        return {"missing": f"pip install {peer.package}"}
    problem = Problem.load(_duration(bench, peer))
    try:
        run = Kept(peer.prepare(problem))
        work = Work(run, problem.duration * peer.batch, prepared=True)
        figures = compared(work, bench.reference, bench.pace)
    except NoCompiler:
        raise
    except Exception as error:  # a peer that fails must not take the others with it
        return {"failed": " ".join(f"{type(error).__name__}: {error}".split())[:200]}
    error = _error(peer, run.latest, problem)
    known = [value for value in error.values() if value is not None]
    same = len(known) == len(error) and max(known) < peer.tolerance + STRADDLING
    return {**figures, "error": error, "same": same}


def _duration(bench: Bench, peer: Peer) -> float:
    """Length of its runs: the work of adaptive solvers gathers at the impacts."""
    if peer.continuous or peer is REFERENCE:
        return 10.0
    return bench.pace.sampled if peer.batch == 1 else bench.pace.batch


def _error(peer: Peer, rows: np.ndarray, problem: Problem) -> dict[str, float | None]:
    """Largest error of a joint angle [rad] and of the mass [m] over what is shown of a run."""
    exact = _exact(peer.continuous)[: len(problem.times)]
    off = np.abs(rows[: len(exact)] - exact)
    largest = {"q": float(off[:, :2].max()), "x_m": float(off[:, 2].max())}
    return {name: value if np.isfinite(value) else None for name, value in largest.items()}


@cache
def _exact(continuous: bool) -> np.ndarray:
    """Rows of ``[q1, q2, x_m]`` by the reference of the sampled loop, or of the continuous one."""
    scenario = problem_scenario(SHOWN)
    loop, start = scenario.closed_loop, scenario.start
    if continuous:
        times = np.arange(0, round(SHOWN / loop.dt), RECORD_EVERY) * loop.dt
        run = alight.reference(loop, start, times).recording
        return np.column_stack([run["q"], run["x_m"]])
    run = sampled_reference(loop, start, SHOWN)
    return np.column_stack([run["q"], run["x_m"]])[::RECORD_EVERY]
