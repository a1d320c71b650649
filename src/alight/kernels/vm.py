"""CasADi's virtual machine: needs no compiler."""

from __future__ import annotations

import numpy as np

from alight.kernels.direct import Direct
from alight.kernels.program import Program, stop_index

LONG, SHORT = 256, 16
"""Ticks in one call of the virtual machine: enough to forget what the call costs, and few enough to
lose little where the tick after which the seldom part is called is likely near."""


class VirtualMachine:
    """Runs a program in CasADi's virtual machine."""

    name = "vm"

    def __init__(self, program: Program) -> None:
        self._once, self._seldom = Direct(program.once), Direct(program.seldom)
        self._repeats, self._count = program.repeats, len(program.parameters)
        self._head = program.seldom.numel_out(0)
        self._blocks = {n: Direct(program.hot.mapaccum("block", n)) for n in (LONG, SHORT)}

    def run(self, x: np.ndarray, w: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Run as many ticks as ``w`` has entries; see `Runner`."""
        kept = self._once(p)[0]
        repeated = {n: np.tile(kept, n) for n in self._blocks}
        rows: list[np.ndarray] = []
        done, calm = 0, LONG  # calm: ticks since the last one that needed the seldom part
        while done < len(w):
            size = LONG if calm >= LONG // 2 else SHORT
            noise = np.zeros(size)  # ticks after the last one are run and left out
            part = w[done : done + size]
            noise[: len(part)] = part
            states, y, given, calls = self._call(size, x, noise, repeated[size])
            called = np.flatnonzero(calls[: len(part)])
            ticks = int(called[0]) + 1 if len(called) else len(part)
            block = y[:ticks]
            ran = stop_index(block)
            before = states[ran - 2] if ran > 1 else x
            x = states[ran - 1]
            if ran == ticks and len(called):
                x[: self._head], trip = self._located(before[: self._head], given[ran - 1], p)
                block[-1, -1] = block[-1, -1] or trip
            rows.append(block[:ran])
            done, calm = done + ran, 0 if len(called) else calm + ran
            if ran < ticks or block[ran - 1, -1] or not np.isfinite(block[ran - 1]).all():
                break
        return x, np.concatenate(rows)

    def _call(self, size: int, *args: np.ndarray) -> list[np.ndarray]:
        """Outputs of a block, one row for each tick."""
        return [output.reshape(size, -1) for output in self._blocks[size](*args)]

    def _located(
        self, head: np.ndarray, given: np.ndarray, p: np.ndarray
    ) -> tuple[np.ndarray, float]:
        trip = 0.0
        for _ in range(self._repeats):
            head, lost = self._seldom(head, given, p)
            trip = max(trip, float(lost[0]))
        return head, trip
