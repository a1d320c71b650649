"""A law of the bench, compiled and with its share of a row of telemetry."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import casadi as ca
import numpy as np

from alight.control.adaptive import AdaptiveContactLaw, AdaptiveState
from alight.errors import AlightError
from alight.kernels.select import Backend
from alight.kernels.stepper import Stepper
from alight.live.bank import Bank, ColumnOf
from alight.models import PlantState
from alight.scenarios.limits import Limit
from alight.simulation.closed_loop import MEASURED_SIGNALS, PLANT, SENSORS, ClosedLoop
from alight.simulation.controller import Controller
from alight.simulation.law_tick import OUTPUTS
from alight.symbolic.build import build
from alight.symbolic.parameters import lift, values_of
from alight.symbolic.signals import Layout, Signal
from alight.theory.lyapunov import V_r

NOT_FINITE, LIMIT = 201, 202
LARGEST = np.finfo(float).max
MEMORY = slice(SENSORS.size, -1)
"""Where the law's own state stands in that of a `Controller`: after the readings of one sample
before, ahead of the trip."""


class Seat:
    """What one law does in a tick, on arrays that stay where they are.

    Parameters
    ----------
    bank : Bank
        The laws.
    number : int
        Which of them.
    layout : Layout
        That of a row of telemetry.
    device : mapping of str to Signal
        What the device tells; where that begins with the state of the plant, `V_r` is watched.
    backend : {"auto", "vm", "c"}
        See `Stepper`.
    """

    def __init__(
        self,
        bank: Bank,
        number: int,
        layout: Layout,
        device: Mapping[str, Signal],
        backend: Backend,
    ) -> None:
        loop = bank.loops[number]
        self.controller = Controller(loop, backend)
        self.column = ColumnOf(loop)
        self._layout = loop.law_layout
        self._start = self._layout.pack(dict(loop.law.initial_state()))
        self.reading, self.torque = self.controller.reading, self.controller.torque
        self._advance, stepper = self.controller.step, self.controller.stepper
        self._before, self._memory = stepper.x[: SENSORS.size], stepper.x[MEMORY]
        self._trip = stepper.x[-1:]
        self.state = self._memory.copy()
        """The law's state before the tick."""
        self._told = stepper.y[OUTPUTS["torque"].size :]
        told = [*OUTPUTS, *MEASURED_SIGNALS, *loop.law.signals]
        self._told_at = _places(layout, told[1:])
        self._state_at = _places(layout, list(loop.law.states))
        self._watch = _watch(loop, device, backend)
        self._own = len(values_of(loop.law)) if self._watch else 0
        self._check = _Check(layout, self._present(layout, bank), bank.scenario.document.limits)

    def _present(self, layout: Layout, bank: Bank) -> np.ndarray:
        """Columns of a row that this law fills, and those that no law does."""
        laws = {name for loop in bank.loops for name in (*loop.law.signals, *loop.law.states)}
        own = {*self.controller.loop.law.signals, *self.controller.loop.law.states}
        watched = set() if self._watch else {"V_r"}
        absent = (laws - own) | watched
        return _places(layout, [name for name in layout.signals if name not in absent])

    # Between two ticks

    def take(self, loop: ClosedLoop, column: np.ndarray) -> None:
        """Put parameters in force: a loop that `column` has made of them, and themselves."""
        self.column.take(loop, column)
        self.controller.loop = loop
        self.controller.stepper.p[:] = column
        if self._watch:
            self._watch.p[-self._own :] = column[-self._own :]
        self._start[:] = self._layout.pack(dict(loop.law.initial_state()))

    def restart(self) -> None:
        """Return the law's state to its start; what was read one sample before stays."""
        self._memory[:] = self._start
        self._trip[0] = 0.0

    def succeed(self, other: Seat) -> None:
        """Take over from another law, and what both have in their state."""
        self.restart()
        self._before[:] = other._before
        theirs = other._layout.slices()
        for name, rows in self._layout.slices().items():
            if other._layout.signals.get(name) == self._layout.signals[name]:
                self._memory[rows] = other._memory[theirs[name]]

    # In a tick

    def step(self) -> None:
        """Compute a tick from `reading`."""
        self.state[:] = self._memory
        self._advance()

    def hold(self) -> None:
        """Take the step of the law's state back."""
        self._memory[:] = self.state
        self._trip[0] = 0.0

    def fill(self, row: np.ndarray, plant: np.ndarray) -> None:
        """Fill in what the law tells, given the state of the plant."""
        row[self._told_at] = self._told
        row[self._state_at] = self.state
        if self._watch:
            self._watch.u[: PLANT.size] = plant
            self._watch.u[PLANT.size :] = self.state
            self._watch.step()
            row[-1] = self._watch.y[0]

    def problem(self, row: np.ndarray) -> tuple[int, str] | None:
        """Trip of a signal that is no number or left its limits, and why; None if all is well."""
        return self._check(row)


class _Check:
    """Whether each of some columns is a number within its limits."""

    def __init__(self, layout: Layout, present: np.ndarray, limits: Mapping[str, Limit]) -> None:
        lower, upper = (np.full(layout.size, end * LARGEST) for end in (-1.0, 1.0))
        for name, limit in limits.items():
            rows = layout.slices().get(name, slice(0))
            lower[rows] = -LARGEST if limit.lower is None else limit.lower
            upper[rows] = LARGEST if limit.upper is None else limit.upper
        self._present, self._count = present, len(present)
        self._lower, self._upper = lower[present], upper[present]
        self._columns = [layout.columns[i] for i in present]
        self._units = [layout.units[i] for i in present]
        self._values = np.empty(len(present))
        self._above, self._below = np.empty(len(present), bool), np.empty(len(present), bool)

    def __call__(self, row: np.ndarray) -> tuple[int, str] | None:
        values = self._values
        row.take(self._present, out=values, mode="clip")
        np.greater_equal(values, self._lower, out=self._above)
        np.less_equal(values, self._upper, out=self._below)
        self._above &= self._below  # false for what is no number
        if np.count_nonzero(self._above) == self._count:
            return None
        return self._worst(int(np.argmin(self._above)))

    def _worst(self, i: int) -> tuple[int, str]:
        name, unit, value = self._columns[i], self._units[i], self._values[i]
        strange = np.flatnonzero(~np.isfinite(self._values))
        if len(strange):
            return NOT_FINITE, f"{self._columns[strange[0]]} is infinite or not a number"
        side, end = (
            ("below", self._lower[i]) if value < self._lower[i] else ("above", self._upper[i])
        )
        return LIMIT, f"{name} = {value:.6g} {unit}".rstrip() + f" is {side} its limit {end:g}"


def _places(layout: Layout, names: Sequence[str]) -> np.ndarray:
    """Numbers of the columns of some signals."""
    rows, columns = layout.slices(), np.arange(layout.size)
    return np.concatenate([columns[rows[name]] for name in names] or [columns[:0]])


def _watch(loop: ClosedLoop, device: Mapping[str, Signal], backend: Backend) -> Stepper | None:
    """`V_r` at a state of plant and law, as a function of every parameter; None without one."""
    if not isinstance(loop.law, AdaptiveContactLaw) or list(device)[:5] != list(PLANT.signals):
        return None
    plant, law = lift(loop.plant), lift(loop.law)
    x, a = ca.SX.sym("plant", PLANT.size), ca.SX.sym("law", loop.law_layout.size)
    state = AdaptiveState(**loop.law_layout.unpack(a))
    try:
        value: Any = V_r(plant.obj, law.obj, PlantState(**PLANT.unpack(x)), state)
    except AlightError:  # a law that does not state its potential
        return None
    inputs = {"u": ca.vertcat(x, a), "x": ca.SX(0, 1), "p": ca.vertcat(plant.symbols, law.symbols)}
    made = Stepper(build("watch", inputs, {"x_next": ca.SX(0, 1), "y": value}), backend)
    made.p[:] = np.concatenate([values_of(loop.plant), values_of(loop.law)])
    return made
