"""A batch without a compiler: one run after the other in CasADi's virtual machine."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np

from alight.kernels.program import Group, Program
from alight.kernels.vm import VirtualMachine


class Serial:
    """Runs a program with its metrics, one run at a time; see `Lanes` for the arguments."""

    name = "vm"
    width = 1
    parallel = False
    """CasADi, called by several threads at once, gives wrong numbers without a word."""

    def __init__(self, program: Program, fold: ca.Function, recorded: Sequence[int] = ()) -> None:
        self._machine = VirtualMachine(program)
        self._fold, self._recorded = fold, list(recorded)
        self._count = len(program.parameters)

    def run(self, group: Group, first: int, noise: np.ndarray, every: int) -> np.ndarray:
        """Advance a group by as many ticks as ``noise`` has rows; see `GroupRunner`."""
        y = self._rows(group, noise[:, 0])
        tripped = y[-1, -1] != 0
        counted = len(y) - int(tripped)
        group.done[0] = first + counted
        if tripped:
            group.alive[0], group.trip[0] = 0.0, y[-1, -1]
        if counted and len(group.memory):
            self._gather(group, y[:counted, :-1], first)
        kept = np.arange(first, first + len(noise)) % every == 0
        rows = np.full((len(noise), len(self._recorded), 1), np.nan)
        rows[: len(y), :, 0] = y[:, self._recorded]
        return rows[kept]

    def _rows(self, group: Group, noise: np.ndarray) -> np.ndarray:
        """Rows of all ticks up to a trip; that a signal is not finite ends no run of a batch."""
        parts: list[np.ndarray] = []
        done = 0
        while done < len(noise) and not (parts and parts[-1][-1, -1]):
            group.x[:, 0], rows = self._machine.run(
                group.x[:, 0], noise[done:], group.p[: self._count, 0]
            )
            parts.append(rows)
            done += len(rows)
        return np.concatenate(parts)

    def _gather(self, group: Group, y: np.ndarray, first: int) -> None:
        ticks = len(y)
        fold = self._fold.mapaccum("gather", ticks)
        settings = np.repeat(group.p[self._count :, :1], ticks, axis=1)
        moments = np.arange(first, first + ticks, dtype=float).reshape(1, -1)
        group.memory[:, :1] = np.asarray(fold(group.memory[:, 0], y.T, moments, settings))[:, -1:]

    def group(self, x: np.ndarray, p: np.ndarray, memory: np.ndarray) -> Group:
        """Lay out one run."""
        one = np.zeros(1)
        return Group(x.copy(), p.copy(), memory[:, None].copy(), one + 1, one.copy(), one.copy())
