"""The law of a scenario on a machine of one's own: readings in, torque out, sample by sample."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Protocol

import numpy as np

from alight.control.law import PlainLaw
from alight.errors import AlightError, UnknownName
from alight.kernels.select import Backend
from alight.kernels.stepper import Stepper
from alight.simulation.closed_loop import SENSORS, ClosedLoop
from alight.simulation.law_tick import LAW_TRIPS, law_parameters, law_tick
from alight.symbolic.parameters import numeric_fields, replaced, structure_of, values_of
from alight.symbolic.signals import Layout
from alight.testbed import SensorState


class HasClosedLoop(Protocol):
    """A `Scenario`, or whatever else has a closed loop."""

    @property
    def closed_loop(self) -> ClosedLoop:
        """Plant, testbed and law."""


class Controller:
    """The law of a closed loop alone, advanced by one sample at each call of `step`.

    What is advanced is what the simulation runs at a sample: velocities by backward difference,
    the law, the clip to the motors' limit. Sensors, noise and delay are those of the machine.
    At the first sample velocities are zero. All arrays keep their addresses, so that they can be
    taken into locals before the loop begins::

        controller = alight.Controller(alight.load_scenario("experiment-1"))
        reading, torque, step = controller.reading, controller.torque, controller.step
        while running:
            reading[:] = read_sensors()  # q1, q2 [rad], x_m [m]
            step()
            command(torque)

    When the law trips, or a reading or a computed torque is infinite or no number, the torque is
    zero at that sample and from then on, the state stays what it was, and `trip` and `reason` say
    why; `reset` starts anew. What zero torque means for the machine, above all one that carries
    weight, is for its brakes.

    The methods are for one thread. `step` alone does not wait, allocate or grow with time.

    Parameters
    ----------
    scenario : Scenario or ClosedLoop
        Gives law, sample rate, motor limits; its plant is not used.
    backend : {"auto", "vm", "c"}
        ``auto`` is compiled C, and CasADi's virtual machine, several times slower, with one
        warning where that cannot be had.

    Attributes
    ----------
    loop : ClosedLoop
        The closed loop with the parameters of now.
    paths : tuple of str
        Paths of the parameters that the law, its measurement or its clip reads.
    reading : (3,) array
        What the sensors show: joint angles [rad] and position of the mass [m]. Fill it.
    torque : (2,) array
        Joint torques for the motors [N m].
    signals : mapping of str to array
        What else is known of the last sample, by the names that recordings use: measured
        velocities, torque before the clip, the signals and the next state of the law.
    step : callable
        Advance by one sample.
    stepper : Stepper
        What runs the law, and on which ``backend``: ``"vm"`` or ``"c"``.

    Raises
    ------
    AlightError
        If the law is a `PlainLaw`, which is called as it is: ``law.tick(...)``.
    UnknownName
        If the backend is not one of the three.
    CompilerUnavailable
        If ``c`` is asked for and cannot be had.
    """

    step: Callable[[], None]

    def __init__(self, scenario: ClosedLoop | HasClosedLoop, backend: Backend = "auto") -> None:
        loop = scenario if isinstance(scenario, ClosedLoop) else _closed_loop(scenario)
        if isinstance(loop.law, PlainLaw):
            name = type(loop.law).__name__
            raise AlightError(f"{name} is a law in ordinary Python: call its own method tick")
        built = law_tick(loop)
        self.loop = loop
        self.paths = _paths(loop, built.used)
        self.stepper = Stepper(built.function, backend)
        self.step = self.stepper.step
        self.reading = self.stepper.u
        outputs = _views(built.outputs, self.stepper.y)
        states = _views(built.state, self.stepper.x)
        self.torque = outputs.pop("torque")
        self._trip = states["trip"]
        self.signals: Mapping[str, np.ndarray] = {
            **outputs,
            **{name: states[name] for name in loop.law_layout.signals},
        }
        self.stepper.p[:] = _values(loop)
        self.reset()

    def __call__(self, q: Any, x_m: float) -> np.ndarray:
        """Advance by one sample at joint angles [rad] and a position of the mass [m].

        Returns the torque [N m] as an array of its own.
        """
        self.reading[:2], self.reading[2] = q, x_m
        self.step()
        return self.torque.copy()

    def reset(self, before: SensorState | None = None) -> None:
        """Begin anew, with the law's state at its start.

        Parameters
        ----------
        before : SensorState, optional
            Readings one sample ago; without them velocities are zero at the first sample.
        """
        previous = np.full(SENSORS.size, np.nan)
        if before is not None:
            previous = SENSORS.pack(before._asdict())
        memory = self.loop.law_layout.pack(dict(self.loop.law.initial_state()))
        self.stepper.x[:] = np.concatenate([previous, memory, [0.0]])
        self.stepper.y[:] = 0.0

    @property
    def trip(self) -> int:
        """Code of the trip that has stopped the law, 0 while it runs."""
        return int(self._trip[0])

    @property
    def reason(self) -> str:
        """Why the law was stopped; empty while it runs."""
        reasons = {**LAW_TRIPS, **self.loop.law.trips}
        return reasons.get(self.trip, f"trip {self.trip}") if self.trip else ""

    def __getitem__(self, path: str) -> Any:
        """Value of a parameter now: a number, or a tuple of them."""
        self._check(path)
        value: Any = self.loop
        for name in path.split("."):
            value = getattr(value, name)
        return value

    def __setitem__(self, path: str, value: Any) -> None:
        """Change a parameter; see `update`."""
        self.update({path: value})

    def update(self, values: Mapping[str, Any]) -> None:
        """Change parameters by path, all of them from the next sample on, or none.

        Nothing is compiled, and the law's state stays what it is.

        Raises
        ------
        UnknownName
            If there is no such parameter; lists those there are.
        AlightError
            If a value is refused: its shape, a bound, or what the parameters must fulfil together.
        """
        for path in values:
            self._check(path)
        loop = replaced(self.loop, values)
        for name, part in law_parameters(loop).items():
            if structure_of(part) != structure_of(getattr(self.loop, name)):
                raise AlightError(f"{', '.join(values)}: another shape needs a new Controller")
        self.loop = loop
        self.stepper.p[:] = _values(loop)

    def _check(self, path: str) -> None:
        if path not in self.paths:
            raise UnknownName("parameter", path, self.paths)


def _closed_loop(scenario: Any) -> ClosedLoop:
    loop = getattr(scenario, "closed_loop", None)
    if not isinstance(loop, ClosedLoop):
        given = type(scenario).__name__
        raise AlightError(f"a Scenario is needed, as load_scenario makes it, not a {given}")
    return loop


def _views(layout: Layout, column: np.ndarray) -> dict[str, np.ndarray]:
    return {name: column[rows] for name, rows in layout.slices().items()}


def _values(loop: ClosedLoop) -> np.ndarray:
    return np.concatenate([values_of(part) for part in law_parameters(loop).values()])


def _paths(loop: ClosedLoop, used: tuple[bool, ...]) -> tuple[str, ...]:
    """Path of every number or vector of which an entry is used."""
    left = iter(used)
    return tuple(
        path
        for name, part in law_parameters(loop).items()
        for path, value, _ in numeric_fields(part, f"{name}.")
        if any([next(left) for _ in np.atleast_1d(value)])
    )
