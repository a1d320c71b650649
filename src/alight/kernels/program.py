"""A tick with a fixed layout, and what runs it many times."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import casadi as ca
import numpy as np

from alight.symbolic.signals import Layout


@dataclass(frozen=True)
class Program:
    """One closed-loop tick ``(x, w, p) -> (x_next, y)`` and the names of its columns.

    The last entry of ``y`` is the trip code; the others are the recorded signals.
    """

    tick: ca.Function
    recorded: Layout
    parameters: tuple[str, ...]


class Runner(Protocol):
    """Runs a program without returning to Python at each tick."""

    name: str

    def run(self, x: np.ndarray, w: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Run as many ticks as ``w`` has entries, or until a trip or a number that is not finite.

        Parameters
        ----------
        x : (n_x,) array
            State before the first tick.
        w : (n,) array
            Standard noise of each tick.
        p : (n_p,) array
            Parameters.

        Returns
        -------
        x_next : (n_x,) array
            State after the last tick run.
        y : (k, n_y) array
            Recorded signals and trip code of each tick run, ``k <= n``.
        """


def stop_index(y: np.ndarray) -> int:
    """Number of rows up to and with the first that tripped or holds a number not finite."""
    bad = (y[:, -1] != 0) | ~np.isfinite(y).all(axis=1)
    return int(np.argmax(bad)) + 1 if bad.any() else len(y)
