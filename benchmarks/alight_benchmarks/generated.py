"""Alight's own expressions for the problem as C, for peers that bring a loop or a solver only.

What the problem has not (tip friction, sensors that round) is left out, as a peer leaves it out.
"""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np

from alight import Measurement, Plant, Scenario
from alight.kernels.direct import Direct
from alight.models import PlantState
from alight.symbolic.build import build
from alight.symbolic.ops import vector
from alight.symbolic.parameters import lift, values_of
from alight_benchmarks.equations import rk4

COMPILERS = ("gcc", "cc", "clang")
FLAGS = ("-O3", "-march=native", "-fPIC", "-shared", "-w")


class NoCompiler(RuntimeError):
    """A peer needs a C compiler, and there is none."""


def start_of(scenario: Scenario) -> np.ndarray:
    """State at the start: ``q``, ``q_dot``, ``x_m``, ``x_m_dot``, and that of the law."""
    start, layout = scenario.start, scenario.closed_loop.law_layout
    at_rest = [*start.q, 0.0, 0.0, start.x_m, 0.0]
    return np.concatenate([at_rest, layout.pack(dict(scenario.law.initial_state()))])


def plant_rates(plant: Plant, x: ca.SX, tau: ca.SX) -> ca.SX:
    """Rates of the plant without tip friction."""
    rates = plant.rates(PlantState(x[:2], x[2:4], x[4], x[5], 0.0), tau)
    return ca.vertcat(rates.q, rates.q_dot, rates.x_m, rates.x_m_dot)


def rates_of(scenario: Scenario) -> ca.Function:
    """Build the right-hand side of the continuous closed loop, ``x -> x_dot``."""
    layout, law = scenario.closed_loop.law_layout, scenario.law
    x = ca.SX.sym("x", 6 + layout.size)
    flow = law.flow(layout.unpack(x[6:]), Measurement(x[:2], x[2:4], x[4], x[5]))
    moving = plant_rates(scenario.plant, x, scenario.testbed.motors.clip(flow.tau))
    return build("rates", {"x": x}, {"x_dot": ca.vertcat(moving, layout.pack(dict(flow.rates)))})


def slopes_of(rates: ca.Function) -> ca.Function:
    """Build the Jacobian of a right-hand side, dense."""
    x = ca.SX.sym("x", rates.numel_in(0))
    return build("slopes", {"x": x}, {"slopes": ca.jacobian(rates(x), x)})


def tick_of(scenario: Scenario) -> tuple[ca.Function, np.ndarray]:
    """Build one sample of the loop with plain Runge-Kutta steps, and the value of its numbers.

    The function is ``(x, before, p) -> (x_next, seen)``: readings are handed to the next sample.
    Numbers are inputs, as they are in Alight, but for those that are zero.
    """
    law, plant = lift(scenario.law, "law."), lift(scenario.plant, "plant.")
    layout, rate = scenario.closed_loop.law_layout, scenario.testbed.sample_rate
    x, before = ca.SX.sym("x", 6 + layout.size), ca.SX.sym("before", 3)
    seen = x[[0, 1, 4]]
    q1_dot, q2_dot, x_m_dot = ca.vertsplit((seen - before) * rate)
    measured = Measurement(x[:2], vector(q1_dot, q2_dot), x[4], x_m_dot)
    done = law.obj.tick(layout.unpack(x[6:]), measured, 1 / rate)
    tau = scenario.testbed.motors.clip(done.tau)

    def rates(moving: Any) -> ca.SX:
        return plant_rates(plant.obj, moving, tau)

    moving = x[:6]
    for _ in range(scenario.document.substeps):
        moving = rk4(rates, moving, 1 / (rate * scenario.document.substeps))

    p = ca.vertcat(law.symbols, plant.symbols)
    numbers = np.concatenate([values_of(scenario.law), values_of(scenario.plant)])
    absent = np.flatnonzero(numbers == 0).tolist()
    x_next = ca.vertcat(moving, layout.pack(dict(done.state)))
    x_next = ca.substitute(x_next, p[absent], ca.SX.zeros(len(absent)))
    inputs = {"x": x, "before": before, "p": p}
    return build("tick", inputs, {"x_next": x_next, "seen": seen}), numbers


def source_of(function: ca.Function) -> str:
    """C source of a function, and the sizes of what a call needs, as macros."""
    generator = ca.CodeGenerator(f"{function.name()}.c", {"with_header": False, "verbose": False})
    generator.add(function)
    sizes = {
        "SZ_ARG": function.sz_arg(),
        "SZ_RES": function.sz_res(),
        "SZ_IW": max(function.sz_iw(), 1),
        "SZ_W": max(function.sz_w(), 1),
    }
    return "\n".join([generator.dump(), *(f"#define {name} {n}" for name, n in sizes.items())])


def compiler() -> str:
    """Path of the compiler of plain C: the first of `COMPILERS` on the path.

    Raises
    ------
    NoCompiler
        If none of them is.
    """
    found = next(filter(None, map(shutil.which, COMPILERS)), None)
    if found is None:
        raise NoCompiler(f"no C compiler ({', '.join(COMPILERS)}) is on the path")
    return found


def library_of(source: str, folder: Path) -> Path:
    """Compile a source in a folder.

    Raises
    ------
    NoCompiler
        If none of `COMPILERS` is on the path.
    """
    code, library = folder / "code.c", folder / "code.so"
    code.write_text(source, "utf-8")
    subprocess.run([compiler(), *FLAGS, str(code), "-o", str(library), "-lm"], check=True)
    return library


def compiled(function: ca.Function) -> Direct:
    """Compile a function, to be called from Python through its buffers."""
    with tempfile.TemporaryDirectory() as folder:
        library = library_of(source_of(function), Path(folder))
        return Direct(ca.external(function.name(), str(library)))
