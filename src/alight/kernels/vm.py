"""CasADi's virtual machine: needs no compiler."""

from __future__ import annotations

import casadi as ca
import numpy as np

from alight.kernels.program import Program, stop_index

BLOCK = 256
"""Ticks in one call of the virtual machine: enough to forget what the call costs."""


class VirtualMachine:
    """Runs a program in CasADi's virtual machine."""

    name = "vm"

    def __init__(self, program: Program) -> None:
        self._tick = program.tick
        self._block = program.tick.mapaccum("block", BLOCK)

    def run(self, x: np.ndarray, w: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Run as many ticks as ``w`` has entries; see `Runner`."""
        rows: list[np.ndarray] = []
        parameters = ca.repmat(ca.DM(p), 1, BLOCK)
        for start in range(0, len(w), BLOCK):
            noise = w[start : start + BLOCK]
            if len(noise) == BLOCK:
                states, y = self._block(x, noise.reshape(1, -1), parameters)
            else:
                states, y = self._tail(x, noise, p)
            block = np.asarray(y).T
            kept = stop_index(block)
            rows.append(block[:kept])
            x = np.asarray(states)[:, kept - 1]
            if kept < len(noise) or block[kept - 1, -1] or not np.isfinite(block[kept - 1]).all():
                break
        return x, np.concatenate(rows)

    def _tail(self, x: np.ndarray, noise: np.ndarray, p: np.ndarray) -> tuple[ca.DM, ca.DM]:
        part = self._tick.mapaccum("tail", len(noise))
        return part(x, noise.reshape(1, -1), ca.repmat(ca.DM(p), 1, len(noise)))
