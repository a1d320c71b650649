"""The order in which a graph is written: what the tick waits for first, the rest in its pauses."""

from __future__ import annotations

import heapq
from collections.abc import Collection, Sequence

from alight.kernels.lanes.graph import Node

# Cycles until a result is there, and cycles of two ports that it takes, on a processor of today.
# Rough is good enough: only the order follows from them.
_COST = {
    "const": (0, 0.0),
    "input": (5, 0.0),
    "not": (1, 0.5),
    "div": (30, 4.0),
    "inv": (26, 3.0),
    "sqrt": (36, 6.0),
    "sin": (45, 14.0),
    "cos": (45, 14.0),
    "turned_sin": (28, 7.0),
    "turned_cos": (28, 7.0),
    "tanh": (60, 16.0),
    "exp": (45, 12.0),
}
_USUAL = (4, 0.5)


def scheduled(nodes: Sequence[Node], needed: Collection[int]) -> list[int]:
    """The needed nodes in an order that keeps the longest chain of dependent operations going.

    List scheduling: of the nodes whose arguments are there, the one comes next from which the
    longest chain leads to an output.
    """
    wanted = set(needed)
    users: dict[int, list[int]] = {i: [] for i in wanted}
    waiting = {}
    for i in wanted:
        arguments = {a for a in nodes[i].args if a in wanted}
        waiting[i] = len(arguments)
        for a in arguments:
            users[a].append(i)
    chain = _chains(nodes, users)
    ready = [(-chain[i], i) for i in wanted if not waiting[i]]
    heapq.heapify(ready)
    coming: list[tuple[float, int]] = []  # when each issued node's result is there
    clock, order = 0.0, []
    while ready or coming:
        while coming and (coming[0][0] <= clock or not ready):
            done, i = heapq.heappop(coming)
            clock = max(clock, done) if not ready else clock
            for user in users[i]:
                waiting[user] -= 1
                if not waiting[user]:
                    heapq.heappush(ready, (-chain[user], user))
        if ready:
            _, i = heapq.heappop(ready)
            latency, taken = _COST.get(nodes[i].op, _USUAL)
            order.append(i)
            heapq.heappush(coming, (clock + latency, i))
            clock += taken
    return order


def _chains(nodes: Sequence[Node], users: dict[int, list[int]]) -> dict[int, float]:
    """Cycles from the start of each node to the end of the longest chain that needs it."""
    chain: dict[int, float] = {}
    for i in sorted(users, reverse=True):
        latency = _COST.get(nodes[i].op, _USUAL)[0]
        chain[i] = latency + max((chain[user] for user in users[i]), default=0.0)
    return chain
