"""A CasADi function as a graph in which each value has one number, and rewrites that save work."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Container
from dataclasses import dataclass, field
from typing import NamedTuple

import casadi as ca

from alight.errors import ExpressionError

NAMES = {
    getattr(ca, name): name.removeprefix("OP_").lower()
    for name in dir(ca)
    if name.startswith("OP_") and isinstance(getattr(ca, name), int)
}
COMPARISONS = ("lt", "le", "eq", "ne", "not", "and", "or")
"""Operations that give a mask."""


class Node(NamedTuple):
    """An operation on nodes, by their numbers; a constant; or an input."""

    op: str
    args: tuple[int, ...] = ()
    value: float | tuple[int, int] = 0.0
    """The constant; of an input, which one and which entry."""


@dataclass
class Graph:
    """Nodes in an order in which each stands after its arguments, and which of them are given."""

    nodes: list[Node] = field(default_factory=list)
    outputs: list[list[int]] = field(default_factory=list)
    """Nodes of each output of the function, entry by entry."""
    _known: dict[Node, int] = field(default_factory=dict)

    def add(self, op: str, *args: int, value: float | tuple[int, int] = 0.0) -> int:
        """Number of a node, the same for the same operation on the same nodes."""
        node = Node(op, args, value)
        if node not in self._known:
            self._known[node] = len(self.nodes)
            self.nodes.append(node)
        return self._known[node]

    def constant(self, value: float) -> int:
        """Number of a constant."""
        return self.add("const", value=value)

    def is_constant(self, number: int, value: float) -> bool:
        """Whether a node is the given constant."""
        node = self.nodes[number]
        return node.op == "const" and node.value == value


def graph_of(function: ca.Function) -> Graph:
    """Read the graph of an SX function.

    Raises
    ------
    ExpressionError
        If the function is not made of scalar operations, or leaves entries out as zeros.
    """
    if not function.is_a("SXFunction"):
        raise ExpressionError(f"{function.name()}: only functions of SX have a graph of scalars")
    sides = [function.sparsity_in(i) for i in range(function.n_in())]
    sides += [function.sparsity_out(i) for i in range(function.n_out())]
    if not all(side.is_dense() for side in sides):
        raise ExpressionError(f"{function.name()}: inputs and outputs must be dense; use build")
    graph = Graph(outputs=[[-1] * function.numel_out(i) for i in range(function.n_out())])
    held: dict[int, int] = {}  # what each place of CasADi's work vector holds now
    for k in range(function.n_instructions()):
        name = NAMES[function.instruction_id(k)]
        given, result = function.instruction_input(k), function.instruction_output(k)
        if name == "output":
            graph.outputs[result[0]][result[1]] = held[given[0]]
        elif name == "input":
            held[result[0]] = graph.add("input", value=(given[0], given[1]))
        elif name == "const":
            held[result[0]] = graph.constant(function.instruction_constant(k))
        else:
            held[result[0]] = graph.add(name, *(held[i] for i in given))
    return graph


Rewrite = Callable[[Graph, Node, int], int | None]
"""Number, in the new graph, of what replaces a node: its arguments are rewritten already, and its
old number is given. None where the node stays."""


def rewritten(graph: Graph, rewrite: Rewrite) -> Graph:
    """Apply a rewrite to each node, and keep what the outputs need."""
    made = Graph()
    now: list[int] = []
    for i, node in enumerate(graph.nodes):
        moved = Node(node.op, tuple(now[a] for a in node.args), node.value)
        other = rewrite(made, moved, i)
        now.append(made.add(moved.op, *moved.args, value=moved.value) if other is None else other)
    made.outputs = [[now[i] for i in entries] for entries in graph.outputs]
    return pruned(made)


def pruned(graph: Graph) -> Graph:
    """The graph without nodes that no output needs."""
    needed = [False] * len(graph.nodes)
    for entries in graph.outputs:
        for i in entries:
            needed[i] = True
    for i in range(len(graph.nodes) - 1, -1, -1):
        if needed[i]:
            for argument in graph.nodes[i].args:
                needed[argument] = True
    made = Graph()
    now: dict[int, int] = {}
    for i, node in enumerate(graph.nodes):
        if needed[i]:
            now[i] = made.add(node.op, *(now[a] for a in node.args), value=node.value)
    made.outputs = [[now[i] for i in entries] for entries in graph.outputs]
    return made


def depends(graph: Graph, inputs: Container[int]) -> list[bool]:
    """Whether each node depends on one of the given inputs."""
    found: list[bool] = []
    for node in graph.nodes:
        if node.op == "input":
            found.append(node.value[0] in inputs)  # type: ignore[index]
        else:
            found.append(any(found[i] for i in node.args))
    return found


def simplified(graph: Graph, parameters: int) -> Graph:
    """The graph with fewer operations in each tick, its values unchanged but for rounding.

    ``parameters`` is the input that stays the same from tick to tick.
    """
    graph = rewritten(graph, _choice)
    graph = rewritten(graph, _sums_of_angles(graph))
    graph = rewritten(graph, _turned_angles(graph))
    return rewritten(graph, _reciprocals(graph, parameters))


def _choice(graph: Graph, node: Node, _: int) -> int | None:
    """A choice between two values as one operation; masks that went through 1 and 0 as masks."""
    if node.op == "add":
        return _select(graph, node)
    if node.op == "lt" and graph.is_constant(node.args[0], 0.0):
        return _mask(graph, node.args[1])
    return None


def _select(graph: Graph, node: Node) -> int | None:
    """``if_else`` of CasADi: the sum of two values of which one is zero."""
    first, second = (graph.nodes[i] for i in node.args)
    if first.op != "if_else_zero" or second.op != "if_else_zero":
        return None
    for yes, no in ((first, second), (second, first)):
        if graph.nodes[no.args[0]] == Node("not", (yes.args[0],)):
            return graph.add("select", yes.args[0], yes.args[1], no.args[1])
    return None


def _mask(graph: Graph, number: int) -> int | None:
    """The mask whose 1 or 0 a value is."""
    node = graph.nodes[number]
    if node.op in COMPARISONS:
        return number
    one_or_zero = (node.op == "if_else_zero" and graph.is_constant(node.args[1], 1.0)) or (
        node.op == "select"
        and graph.is_constant(node.args[1], 1.0)
        and graph.is_constant(node.args[2], 0.0)
    )
    if not one_or_zero:
        return None
    chosen = node.args[0]
    is_mask = graph.nodes[chosen].op in COMPARISONS
    return chosen if is_mask else graph.add("ne", chosen, graph.constant(0.0))


def _sums_of_angles(old: Graph) -> Rewrite:
    """Sine and cosine of a sum from those of its terms, where these are needed anyway."""
    angles = {node.args[0] for node in old.nodes if node.op in ("sin", "cos")}
    sums = {i for i in angles if old.nodes[i].op == "add" and set(old.nodes[i].args) <= angles}

    def rewrite(graph: Graph, node: Node, i: int) -> int | None:
        if node.op not in ("sin", "cos") or old.nodes[i].args[0] not in sums:
            return None
        (s1, c1), (s2, c2) = (
            (graph.add("sin", term), graph.add("cos", term))
            for term in graph.nodes[node.args[0]].args
        )
        if node.op == "sin":
            return graph.add("add", graph.add("mul", s1, c2), graph.add("mul", c1, s2))
        return graph.add("sub", graph.add("mul", c1, c2), graph.add("mul", s1, s2))

    return rewrite


def _turned_angles(old: Graph) -> Rewrite:
    """Sine and cosine of an angle plus a small turn, from those of the angle.

    What is no small turn is seen at run time; the result is right in any case.
    """
    angles = {node.args[0] for node in old.nodes if node.op in ("sin", "cos")}
    bases = {
        i: [place for place, term in enumerate(old.nodes[i].args) if term in angles]
        for i in angles
        if old.nodes[i].op == "add"
    }

    def rewrite(graph: Graph, node: Node, i: int) -> int | None:
        if node.op not in ("sin", "cos") or not bases.get(old.nodes[i].args[0]):
            return None
        place = bases[old.nodes[i].args[0]][0]
        terms = graph.nodes[node.args[0]].args
        base, turn = terms[place], terms[1 - place]
        known = graph.add("sin", base), graph.add("cos", base)
        return graph.add(f"turned_{node.op}", node.args[0], *known, turn)

    return rewrite


def _reciprocals(old: Graph, parameters: int) -> Rewrite:
    """Division as multiplication by a reciprocal that several divisions, or all ticks, share."""
    used = Counter(node.args[1] for node in old.nodes if node.op == "div")
    changing = depends(old, [i for i in inputs_of(old) if i != parameters])
    shared = {i for i, count in used.items() if count > 1 or not changing[i]}

    def rewrite(graph: Graph, node: Node, i: int) -> int | None:
        if node.op != "div" or old.nodes[i].args[1] not in shared:
            return None
        divisor = graph.nodes[node.args[1]]
        if divisor.op == "const":
            return graph.add("mul", node.args[0], graph.constant(1 / divisor.value))  # type: ignore[operator]
        return graph.add("mul", node.args[0], graph.add("inv", node.args[1]))

    return rewrite


def inputs_of(graph: Graph) -> set[int]:
    """Inputs of the function that the graph uses."""
    return {node.value[0] for node in graph.nodes if node.op == "input"}  # type: ignore[index]
