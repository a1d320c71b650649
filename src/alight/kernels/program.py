"""A tick with a fixed layout, and what runs it many times."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import casadi as ca
import numpy as np

from alight.symbolic.build import build
from alight.symbolic.signals import Layout


@dataclass(frozen=True)
class Program:
    """One closed-loop tick ``(x, w, p) -> (x_next, y)`` and the names of its columns.

    The last entry of ``y`` is the trip code; the others are the recorded signals. What few ticks
    need stands in a function of its own, which the others do not evaluate.
    """

    usual: ca.Function
    """``(x, w, p) -> (x_next, y, given, calls)``: the tick, unless ``calls`` is not zero."""
    seldom: ca.Function
    """``(head, given, p) -> (head_next, trip)``: called for a tick where ``calls`` is not zero, it
    gives the first entries of ``x_next`` from those of ``x``, and a trip code if that fails."""
    repeats: int
    """How often `seldom` is called for such a tick, each time on what it gave before."""
    recorded: Layout
    parameters: tuple[str, ...]

    @cached_property
    def once(self) -> ca.Function:
        """``p -> kept``: the parameters, and what a tick computes from them alone."""
        return self._hoisted[0]

    @cached_property
    def hot(self) -> ca.Function:
        """`usual` with ``kept`` in the place of the parameters: what every tick must compute."""
        return self._hoisted[1]

    @cached_property
    def _hoisted(self) -> tuple[ca.Function, ca.Function]:
        x, w, p = (ca.SX.sym(self.usual.name_in(i), self.usual.size1_in(i)) for i in range(3))
        names = [self.usual.name_out(i) for i in range(self.usual.n_out())]
        outputs = self.usual(x, w, p)
        rest, symbols, values = ca.extract_parametric(ca.vertcat(*outputs), p)
        kept = ca.vertcat(p, *symbols)
        parts = ca.vertsplit(rest, np.cumsum([0, *(o.numel() for o in outputs)]).tolist())
        once = build("once", {"p": p}, {"kept": ca.vertcat(p, *values)})
        inputs = {"x": x, "w": w, "kept": kept}
        return once, build("hot", inputs, dict(zip(names, parts, strict=True)))

    @cached_property
    def tick(self) -> ca.Function:
        """``(x, w, kept) -> (x_next, y)``: the tick as one function that branches on ``calls``."""
        x, w, kept = (ca.MX.sym(self.hot.name_in(i), self.hot.size1_in(i)) for i in range(3))
        x_next, y, given, calls = self.hot(x, w, kept)
        count = self.seldom.size1_out(0)
        head, trip = x[:count], ca.MX(0.0)
        for _ in range(self.repeats):
            head, lost = self.seldom(head, given, kept[: self.seldom.size1_in(2)])
            trip = ca.fmax(trip, lost)
        plain = ca.vertcat(x_next[:count], 0)
        made = ca.if_else(calls, ca.vertcat(head, trip), plain, True)
        x_next = ca.vertcat(made[:count], x_next[count:])
        y = ca.vertcat(y[:-1, 0], ca.if_else(y[-1] > 0, y[-1], made[count]))
        return ca.Function("tick", [x, w, kept], [x_next, y], ["x", "w", "kept"], ["x_next", "y"])


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


@dataclass
class Group:
    """Runs that advance together: each array holds one run in each of its last places."""

    x: np.ndarray
    """State, (n_x, width)."""
    p: np.ndarray
    """Parameters, then the settings of the metrics, (n, width)."""
    memory: np.ndarray
    """Memory of the metrics, (n_m, width)."""
    alive: np.ndarray
    """1 while the run goes on, (width,)."""
    done: np.ndarray
    """Ticks that the metrics have gathered: all before a trip, (width,)."""
    trip: np.ndarray
    """Code of the trip that ended the run, else 0, (width,)."""


class GroupRunner(Protocol):
    """Runs groups of runs of a program and gathers its metrics."""

    name: str
    width: int
    """Runs in a group."""
    parallel: bool
    """Whether threads may run groups at the same time."""

    def group(self, x: np.ndarray, p: np.ndarray, memory: np.ndarray) -> Group:
        """Lay out at most ``width`` runs before their first tick, one column each."""

    def run(self, group: Group, first: int, noise: np.ndarray, every: int) -> np.ndarray:
        """Advance a group, each run until it trips.

        Parameters
        ----------
        group : Group
            Changed in place.
        first : int
            Number of the first tick.
        noise : (n, 1) or (n, width) array
            Standard noise of each tick, shared by the runs or one for each.
        every : int
            Ticks whose number it divides are recorded.

        Returns
        -------
        (k, n_r, width) array
            The recorded entries; what stands after the trip of a run means nothing.
        """


def stop_index(y: np.ndarray) -> int:
    """Number of rows up to and with the first that tripped or holds a number not finite."""
    bad = (y[:, -1] != 0) | ~np.isfinite(y).all(axis=1)
    return int(np.argmax(bad)) + 1 if bad.any() else len(y)
