"""A graph as straight-line C over lanes, in the words of ``vector.h``."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from alight.errors import ExpressionError
from alight.kernels.lanes.graph import COMPARISONS, Graph, Node, depends, inputs_of
from alight.kernels.lanes.schedule import scheduled

VALUES = {
    "add": "{0} + {1}",
    "sub": "{0} - {1}",
    "mul": "{0} * {1}",
    "div": "v_div({0}, {1})",
    "neg": "-{0}",
    "twice": "{0} + {0}",
    "sq": "{0} * {0}",
    "inv": "v_inv({0})",
    "fmin": "v_min({0}, {1})",
    "fmax": "v_max({0}, {1})",
    "sqrt": "v_root({0})",
    "constpow": "v_pow({0}, {1})",
    "assign": "{0}",
}
"""Operations that ``vector.h`` does not have under CasADi's name."""
PLAIN = frozenset(
    (
        *("floor", "ceil", "fabs", "sign", "copysign", "fmod", "remainder", "hypot", "pow"),
        *("tanh", "exp", "log", "log1p", "expm1", "erf", "sin", "cos", "tan", "atan2"),
        *("asin", "acos", "atan", "sinh", "cosh", "asinh", "acosh", "atanh"),
    )
)
"""Operations that are called ``v_`` and CasADi's name."""
MASKS = {
    "lt": "m_lt({0}, {1})",
    "le": "m_le({0}, {1})",
    "eq": "m_eq({0}, {1})",
    "ne": "m_ne({0}, {1})",
    "not": "m_not({0})",
    "and": "m_and({0}, {1})",
    "or": "m_or({0}, {1})",
}
OF_MASKS = ("not", "and", "or")
"""Comparisons whose arguments are masks themselves."""


@dataclass(frozen=True)
class Names:
    """How the inputs and outputs of a graph are called in C, entry by entry."""

    inputs: Mapping[int, str]
    """Pattern for the entries of each input: ``"x[{}]"``."""
    outputs: Mapping[int, str]
    """Pattern for the entries of each output."""


def body(graph: Graph, names: Names, given: Mapping[int, str] | None = None) -> list[str]:
    """Lines that compute the outputs; ``given`` values stand in the named places already."""
    writer = _Writer(graph, names, given or {})
    wanted = [i for output in names.outputs for i in graph.outputs[output]]
    for i in scheduled(graph.nodes, writer.needed_for(wanted)):
        writer.write(i)
    for output, pattern in names.outputs.items():
        for entry, i in enumerate(graph.outputs[output]):
            writer.lines.append(f"{pattern.format(entry)} = {writer.value(i)};")
    return writer.lines


def kept(graph: Graph, parameters: int) -> list[int]:
    """Values that depend on the parameters alone, and that others need: made once for a run."""
    tick = depends(graph, [i for i in inputs_of(graph) if i != parameters])
    in_tick = [t or node.op in COMPARISONS for t, node in zip(tick, graph.nodes, strict=True)]
    needed = {i for entries in graph.outputs for i in entries}
    needed |= {a for i, node in enumerate(graph.nodes) if in_tick[i] for a in node.args}
    free = ("const", "input")
    return [i for i in sorted(needed) if not in_tick[i] and graph.nodes[i].op not in free]


class _Writer:
    """Writes nodes, each once, as masks or as values."""

    def __init__(self, graph: Graph, names: Names, given: Mapping[int, str]) -> None:
        self._nodes, self._names, self._given = graph.nodes, names, given
        self._texts: dict[int, str] = dict(given)
        self._spare = 0
        self._pairs = _pairs(graph)
        self.lines: list[str] = []

    def needed_for(self, wanted: Sequence[int]) -> list[int]:
        """Nodes that must be written for the wanted ones, in order."""
        found, open_ = set(), list(wanted)
        while open_:
            i = open_.pop()
            if i not in found and i not in self._given:
                found.add(i)
                open_ += self._nodes[i].args
        return sorted(found)

    def value(self, i: int) -> str:
        """A node as a value."""
        is_mask = self._nodes[i].op in COMPARISONS
        return f"v_from_mask({self._texts[i]})" if is_mask else self._texts[i]

    def mask(self, i: int) -> str:
        """A node as a mask."""
        is_mask = self._nodes[i].op in COMPARISONS
        return self._texts[i] if is_mask else f"m_from_value({self._texts[i]})"

    def write(self, i: int) -> None:
        """Write a node whose arguments are written."""
        if i in self._texts:
            return
        node = self._nodes[i]
        if node.op == "const":
            self._texts[i] = f"v_set({_number(float(node.value))})"  # type: ignore[arg-type]
        elif node.op == "input":
            which, entry = node.value  # type: ignore[misc]
            self._texts[i] = self._names.inputs[which].format(entry)
        elif node.op in COMPARISONS:
            self._name(i, "M", self._comparison(node))
        elif i in self._pairs:
            self._sine_and_cosine(*self._pairs[i])
        else:
            self._name(i, "V", self._operation(node))

    def _name(self, i: int, kind: str, text: str) -> None:
        self._texts[i] = f"a{i}"
        self.lines.append(f"const {kind} a{i} = {text};")

    def _comparison(self, node: Node) -> str:
        take = self.mask if node.op in OF_MASKS else self.value
        return MASKS[node.op].format(*(take(i) for i in node.args))

    def _operation(self, node: Node) -> str:
        if node.op == "select":
            chosen, yes, no = node.args
            return f"v_select({self.mask(chosen)}, {self.value(yes)}, {self.value(no)})"
        if node.op == "if_else_zero":
            return f"v_where0({self.mask(node.args[0])}, {self.value(node.args[1])})"
        arguments = [self.value(i) for i in node.args]
        if node.op in VALUES:
            return VALUES[node.op].format(*arguments)
        if node.op in PLAIN:
            return f"v_{node.op}({', '.join(arguments)})"
        raise ExpressionError(f"the operation {node.op!r} has no form for lanes")

    def _sine_and_cosine(self, sine: int | None, cosine: int | None) -> None:
        """Write both at once, even if one of them has no use: the compiler drops what it can."""
        node = self._nodes[sine if sine is not None else cosine]  # type: ignore[index]
        names = [f"unused{self._spare}" if i is None else f"a{i}" for i in (sine, cosine)]
        self._spare += 1
        for i, name in zip((sine, cosine), names, strict=True):
            if i is not None:
                self._texts[i] = name
        called = "v_sincos_turned" if node.op.startswith("turned") else "v_sincos"
        arguments = ", ".join(self.value(i) for i in node.args)
        self.lines.append(f"V {names[0]}, {names[1]};")
        self.lines.append(f"{called}({arguments}, &{names[0]}, &{names[1]});")


def _number(value: float) -> str:
    """A number in C, to its last bit."""
    if math.isfinite(value):
        return value.hex()
    return "NAN" if math.isnan(value) else f"{'-' if value < 0 else ''}HUGE_VAL"


def _pairs(graph: Graph) -> dict[int, tuple[int | None, int | None]]:
    """Sine and cosine of the same angle, by the number of either."""
    found: dict[tuple[bool, tuple[int, ...]], list[int | None]] = {}
    for i, node in enumerate(graph.nodes):
        if node.op in ("sin", "cos", "turned_sin", "turned_cos"):
            pair = found.setdefault((node.op.startswith("turned"), node.args), [None, None])
            pair[node.op.endswith("cos")] = i
    pairs = ((sine, cosine) for sine, cosine in found.values())
    return {i: pair for pair in pairs for i in pair if i is not None}
