"""A scenario with all it has in plain C: what a careful user would get from the same expressions.

Sensors, noise, law, clip, friction and metrics are Alight's; the plant takes classical Runge-Kutta
steps that know nothing of the switch of contact, in scalar C at -O3. It does not look for trips.
"""

from __future__ import annotations

import ctypes
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

from alight import Scenario
from alight.models import PlantState
from alight.simulation.closed_loop import PLANT, ClosedLoop, check_channels, tick_program
from alight.simulation.metrics import Gathering, chosen, steady_first
from alight.symbolic.build import build
from alight.symbolic.parameters import lift
from alight_benchmarks.equations import rk4
from alight_benchmarks.generated import library_of, source_of
from alight_benchmarks.own.problems import PLAIN_SUBSTEPS

LOOP = """
void run(long long n, double* x, const double* noise, const double* p, double* memory,
         const double* settings, double* rows) {
  const double* arg[SZ_ARG];
  double* res[SZ_RES];
  casadi_int iw[SZ_IW];
  double w[SZ_W], next[N_X], remembered[N_MEMORY + 1], now;
  long long k, i;
  for (k = 0; k < n; ++k) {
    now = (double)k;
    arg[0] = x, arg[1] = noise + k, arg[2] = p, arg[3] = memory, arg[4] = &now, arg[5] = settings;
    res[0] = next, res[1] = rows + k * N_Y, res[2] = remembered;
    tick(arg, res, iw, w, 0);
    for (i = 0; i < N_X; ++i) x[i] = next[i];
    for (i = 0; i < N_MEMORY; ++i) memory[i] = remembered[i];
  }
}
"""


@dataclass(frozen=True)
class PlainC:
    """A prepared run; a call draws its noise and returns what was recorded, (n, columns)."""

    call: Callable[[], np.ndarray]
    memory: np.ndarray
    """Of the metrics after the latest call."""


def prepared(
    scenario: Scenario,
    *,
    substeps: int = PLAIN_SUBSTEPS,
    channels: tuple[str, ...] | None = (),
    metrics: bool = False,
) -> PlainC:
    """Compile a scenario; ``channels`` are recorded at every sample, all of them if None."""
    loop = scenario.closed_loop
    gathering = Gathering(chosen(None if metrics else (), loop.signals))
    tick = tick_of(loop, substeps, channels, gathering)
    run = _compiled(tick)
    start, p = loop.initial_column(scenario.start), loop.parameter_values(loop.zeros())
    ticks = max(round(scenario.document.duration / loop.dt), 1)
    travel = abs(scenario.target.x_md - scenario.plant.body.x_0)
    first = steady_first(ticks, loop.dt, scenario.document.steady_state)
    settings, memory = np.array([first, travel], dtype=float), np.zeros(len(gathering.start))

    def call() -> np.ndarray:
        noise = np.random.default_rng(scenario.document.seed).standard_normal(ticks)
        rows = np.empty((ticks, tick.numel_out(1)))
        memory[:] = gathering.start
        run(ticks, start.copy(), noise, p, memory, settings, rows)
        return rows

    return PlainC(call, memory)


def tick_of(
    loop: ClosedLoop, substeps: int, channels: tuple[str, ...] | None, gathering: Gathering
) -> ca.Function:
    """Build ``(x, w, p, memory, k, settings) -> (x_next, y, memory_next)``."""
    zeros, recorded = loop.zeros(), check_channels(loop, channels)
    wanted = None if channels is None else tuple({*gathering.needs, *channels})
    program = tick_program(loop, wanted, zeros)
    plant = lift(loop.plant, "plant.", zeros)
    others = ca.SX.sym("p", len(program.parameters) - len(plant.paths))
    x, w, p = (
        ca.SX.sym("x", program.usual.size1_in(0)),
        ca.SX.sym("w"),
        ca.vertcat(plant.symbols, others),
    )
    x_next, y, tau, _ = program.usual(x, w, p)

    def rates(column: Any) -> Any:
        return PLANT.pack(plant.obj.rates(PlantState(**PLANT.unpack(column)), tau)._asdict())

    moving = x[: PLANT.size]
    for _ in range(substeps):
        moving = rk4(rates, moving, loop.dt / substeps)
    fold = gathering.fold(program.recorded)
    memory, k = ca.SX.sym("memory", fold.size1_in(0)), ca.SX.sym("k")
    settings = ca.SX.sym("settings", fold.size1_in(3))
    rows = program.recorded.slices()
    kept = [i for name in recorded.signals for i in range(rows[name].start, rows[name].stop)]
    inputs = {"x": x, "w": w, "p": p, "memory": memory, "k": k, "settings": settings}
    outputs = {
        "x_next": ca.vertcat(moving, x_next[PLANT.size :]),
        "y": y[kept],
        "memory_next": fold(memory, y[: program.recorded.size], k, settings),
    }
    return build("tick", inputs, outputs)


def _compiled(tick: ca.Function) -> Callable[..., None]:
    sizes = {"N_X": tick.numel_out(0), "N_Y": tick.numel_out(1), "N_MEMORY": tick.numel_out(2)}
    defines = [f"#define {name} {size}" for name, size in sizes.items()]
    source = "\n".join([source_of(tick), *defines, LOOP])
    with tempfile.TemporaryDirectory() as folder:
        run = ctypes.CDLL(str(library_of(source, Path(folder)))).run
    doubles = np.ctypeslib.ndpointer(dtype=np.float64, flags="C_CONTIGUOUS")
    run.argtypes, run.restype = [ctypes.c_longlong, *[doubles] * 6], None
    return run
