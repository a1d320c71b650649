"""The arithmetic of a tick over what one core can do at most, beside what is achieved."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Any

from alight.kernels.lanes import source
from alight.kernels.lanes.graph import Graph, depends, graph_of, inputs_of, simplified
from alight.simulation.closed_loop import tick_program
from alight.simulation.metrics import Gathering, chosen
from alight_benchmarks.own.batch import batch_of
from alight_benchmarks.own.bench import Bench
from alight_benchmarks.own.peak import lanes, peak
from alight_benchmarks.own.problems import ideal
from alight_benchmarks.own.ratios import Work, compared

DURATION = 10.0


@dataclass(frozen=True)
class Cost:
    """Arithmetic operations of a function; a fused multiply-add is one that counts for two."""

    fused: int
    single: int

    @property
    def operations(self) -> int:
        """Instructions."""
        return self.fused + self.single

    @property
    def flops(self) -> int:
        """Floating-point operations."""
        return 2 * self.fused + self.single


PLAIN = ("add", "sub", "mul", "sq", "twice", "neg")
CHOICES = ("fmin", "fmax", "fabs", "sign", "copysign", "select", "if_else_zero", "floor", "ceil")
"""With comparisons: they take time and are no arithmetic."""
AVX512 = {"div": Cost(4, 2), "inv": Cost(4, 1), "sqrt": Cost(5, 3)}
"""As ``tick_math.h`` writes them where division blocks its unit."""
OTHERS = dict.fromkeys(AVX512, Cost(0, 1))
FUNCTIONS = {"sincos": Cost(17, 5), "turned": Cost(6, 7), "tanh": Cost(10, 11), "exp": Cost(13, 5)}
"""As ``vector_math.h`` and ``tick_math.h`` write them, without what works on bits."""


def measure(bench: Bench) -> dict[str, Any]:
    """Operations of a tick, their shortest time, and the time of a tick."""
    scenario = ideal(DURATION)
    counted = count(usual_graph(scenario.closed_loop))
    bench.report(0.2, "peak of one core")
    most = peak(bench.pace.seconds / 3)
    bench.report(0.6, "time of a tick")
    runs = 8 * lanes()
    ticks = round(DURATION / scenario.closed_loop.dt) * runs
    work = Work(batch_of(scenario, runs), runs * DURATION)
    tick = compared(work, bench.reference, bench.pace)["seconds"]["low"] / ticks
    fused, single = (
        counted["flops"] / most["fused_flops"],
        counted["operations"] / most["single_flops"],
    )
    return {**counted, **most, "tick": tick, "if_fused": fused, "if_single": single}


def usual_graph(loop: Any) -> Graph:
    """The graph of the tick of a batch with all metrics, as it is written in C."""
    gathering = Gathering(chosen(None, loop.signals))
    program = tick_program(loop, gathering.needs, loop.zeros())
    function = source.with_metrics(program.usual, gathering.fold(program.recorded))
    return simplified(graph_of(function), source.PARAMETERS)


def count(graph: Graph) -> dict[str, Any]:
    """Operations in a tick; what depends on parameters alone is computed once for a run.

    Raises
    ------
    KeyError
        If the graph holds an operation of unknown cost.
    """
    varying = depends(graph, [i for i in inputs_of(graph) if i != source.PARAMETERS])
    done = [node for node, varies in zip(graph.nodes, varying, strict=True) if varies]
    found = Counter(node.op for node in done if node.op not in _ANGLES)
    angles = {(_ANGLES[node.op], node.args) for node in done if node.op in _ANGLES}
    found.update(kind for kind, _ in angles)
    quotients = AVX512 if lanes() == 8 else OTHERS
    costs = {**dict.fromkeys(PLAIN, Cost(0, 1)), **quotients, **FUNCTIONS}
    arithmetic = {op: n for op, n in found.items() if op not in _NO_ARITHMETIC}
    functions = {op: n for op, n in arithmetic.items() if op in FUNCTIONS}
    return {
        "nodes": sum(n for op, n in found.items() if op != "input"),
        "arithmetic": sum(n for op, n in arithmetic.items() if op in PLAIN),
        "quotients": sum(n for op, n in arithmetic.items() if op in quotients),
        "functions": functions,
        "choices": sum(n for op, n in found.items() if op in _NO_ARITHMETIC and op != "input"),
        "operations": sum(costs[op].operations * n for op, n in arithmetic.items()),
        "function_operations": sum(FUNCTIONS[op].operations * n for op, n in functions.items()),
        "flops": sum(costs[op].flops * n for op, n in arithmetic.items()),
    }


_ANGLES = {"sin": "sincos", "cos": "sincos", "turned_sin": "turned", "turned_cos": "turned"}
_COMPARISONS = ("lt", "le", "eq", "ne", "not", "and", "or")
_NO_ARITHMETIC = (*CHOICES, *_COMPARISONS, "input", "const", "assign")
