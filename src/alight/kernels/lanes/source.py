"""The C source of a batch: a program and the fold of its metrics over lanes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib import resources

import casadi as ca

from alight.kernels.lanes.emit import Names, body, kept
from alight.kernels.lanes.graph import Graph, graph_of, simplified
from alight.kernels.program import Program
from alight.symbolic.build import build

HEADERS = ("vector.h", "vector_math.h", "tick_math.h")
PARAMETERS = 2
"""Input of a tick that stays the same for a run."""
SELDOM = "static __attribute__((noinline))"
EXPORT = '#define ALIGHT_EXPORT __attribute__((visibility("default")))'


def source_of(program: Program, fold: ca.Function, recorded: Sequence[int]) -> str:
    """Self-contained C of a batch.

    Parameters
    ----------
    program : Program
        The tick.
    fold : casadi.Function
        ``(memory, y, k, settings) -> memory_next``, of the program's signals.
    recorded : sequence of int
        Entries of the signals that a row records.
    """
    usual, seldom = with_metrics(program.usual, fold), program.seldom
    outputs = ("x_next", "y", "given", "calls", "memory_next")
    parts = [
        _function("usual", usual, {0: "x", 1: "w", 3: "memory", 4: "k"}, outputs, "V_INLINE"),
        _function("seldom", seldom, {0: "x", 1: "given"}, ("head", "lost"), SELDOM),
    ]
    sizes = {
        "NX": usual.numel_out(0),
        "NY": usual.numel_out(1),
        "NG": usual.numel_out(2),
        "NH": seldom.numel_out(0),
        "REPEATS": program.repeats,
        "NM": usual.numel_out(4),
        "NR": len(recorded),
        "RECORDED": "{" + ", ".join(str(i) for i in (*recorded, 0)) + "}",
    }
    defines = [f"#define {name} {value}" for name, value in sizes.items()]
    files = resources.files("alight.kernels.lanes")
    head = [files.joinpath(name).read_text("utf-8") for name in HEADERS]
    for name in HEADERS:
        head = [text.replace(f'#include "{name}"', "") for text in head]
    tail = files.joinpath("batch.c").read_text("utf-8")
    return "\n".join([*head, EXPORT, *defines, *parts, tail])


def with_metrics(usual: ca.Function, fold: ca.Function) -> ca.Function:
    """The usual tick and the fold as one function, whose parameters hold the metrics' settings."""
    x, w, p = (ca.SX.sym(usual.name_in(i), usual.size1_in(i)) for i in range(3))
    memory, k = ca.SX.sym("memory", fold.size1_in(0)), ca.SX.sym("k")
    settings = ca.SX.sym("settings", fold.size1_in(3))
    x_next, y, given, calls = usual(x, w, p)
    memory_next = fold(memory, y[: fold.size1_in(1)], k, settings)
    inputs = {"x": x, "w": w, "p": ca.vertcat(p, settings), "memory": memory, "k": k}
    outputs = {"x_next": x_next, "y": y, "given": given, "calls": calls}
    outputs["memory_next"] = memory_next
    return build("usual", inputs, outputs)


def _function(
    name: str,
    function: ca.Function,
    inputs: Mapping[int, str],
    outputs: Sequence[str],
    placement: str,
) -> str:
    """A function in C, and the one that computes what it needs once for a run."""
    graph = simplified(graph_of(function), PARAMETERS)
    once = kept(graph, PARAMETERS)
    given = {i: f"h[{entry}]" for entry, i in enumerate(once)}
    loaded = {i: f"{label}[{{0}}]" for i, label in inputs.items()}
    loaded[PARAMETERS] = "v_load(p + {0} * LANES)"
    named = {i: f"{label}[{{0}}]" for i, label in enumerate(outputs)}
    keep = body(Graph(graph.nodes, [once]), Names(loaded, {0: "h[{0}]"}))
    arguments = [
        *(f"const V *restrict {label}" for label in inputs.values()),
        "const double *restrict p",
        "const V *restrict h",
        *(f"V *restrict {label}" for label in outputs),
    ]
    return "\n".join(
        [
            f"#define NK_{name.upper()} {len(once)}",
            f"static __attribute__((noinline)) void {name}_keep(const double *p, V *h) {{",
            *_indented(keep),
            "}",
            f"{placement} void {name}({', '.join(arguments)}) {{",
            *_indented(body(graph, Names(loaded, named), given)),
            "}",
        ]
    )


def _indented(lines: Sequence[str]) -> list[str]:
    return [f"  {line}" for line in ("(void)p, (void)h;", *lines)]
