"""Plant, testbed and law joined to one tick: the function that is simulated and deployed."""

from __future__ import annotations

from collections.abc import Container, Mapping
from dataclasses import dataclass
from typing import Annotated, Any

import casadi as ca
import numpy as np

from alight.control.law import Law, PlainLaw
from alight.control.measurement import Measurement
from alight.errors import UnknownName
from alight.kernels.program import Program
from alight.models import Plant, PlantState
from alight.simulation.integrate import Phases
from alight.symbolic.build import build
from alight.symbolic.derive import traced
from alight.symbolic.ops import (
    Scalar,
    Vector,
    as_vector,
    concatenate,
    fabs,
    maximum,
    vector,
    where,
)
from alight.symbolic.parameters import (
    Quantity,
    is_parameters,
    lift,
    numeric_fields,
    parameters,
    values_of,
)
from alight.symbolic.signals import Layout, Signal
from alight.testbed import SensorState, Testbed

PLANT = Layout.of(PlantState)
SENSORS = Layout.of(SensorState)
DIVERGED, NO_TORQUE = 101, 102
SMALLEST = 1e-100
"""Deflection of the bristle [m] below which it rests."""
TRIPS = {
    DIVERGED: "the plant left the range in which its numbers mean anything",
    NO_TORQUE: "the law gave a torque that is infinite or not a number",
}

PLANT_SIGNALS = {
    **PLANT.signals,
    "x_r": Signal("m", "tip position", 2),
    "x_r_dot": Signal("m/s", "tip velocity", 2),
    "gap": Signal("m", "x_r1 - x_m; negative in free motion"),
    "Lambda": Signal("", "contact indicator, (8)"),
    "F_m": Signal("N", "impact force, (7)"),
    "F_t": Signal("N", "tip friction along X2 on the body"),
    "probe_clearance": Signal("m", "clearance left at the capacitance probe"),
    "det_J": Signal("m^2", "determinant of the Jacobian; zero in a singular pose"),
    "tau_applied": Signal("N m", "torque at the joints after clipping and delay", 2),
}
TORQUE_SIGNALS = {
    "tau": Signal("N m", "torque computed by the law", 2),
    "clipped": Signal("", "1 where the motor clips that torque, else 0", 2),
}
MEASURED = Layout.of(Measurement)
MEASURED_SIGNALS = {f"{name}_measured": signal for name, signal in MEASURED.signals.items()}


@parameters
class InitialState:
    """Where a run starts, at rest unless a velocity is given."""

    q: Annotated[tuple[float, float], Quantity("rad", "joint angles")]
    x_m: Annotated[float, Quantity("m", "position of the mass")]
    q_dot: Annotated[tuple[float, float], Quantity("rad/s", "joint rates")] = (0.0, 0.0)
    x_m_dot: Annotated[float, Quantity("m/s", "velocity of the mass")] = 0.0


@dataclass(frozen=True)
class ClosedLoop:
    """Plant, testbed and law: everything that a run needs but its start and its length."""

    plant: Plant
    testbed: Testbed
    law: Law
    substeps: int = 4

    @property
    def dt(self) -> float:
        """Sample time [s]."""
        return 1.0 / self.testbed.sample_rate

    @property
    def law_layout(self) -> Layout:
        """Layout of the law's state."""
        return Layout(self.law.states)

    @property
    def signals(self) -> dict[str, Signal]:
        """Every signal that a run can record."""
        return {**PLANT_SIGNALS, **MEASURED_SIGNALS, **self.law_signals}

    @property
    def law_signals(self) -> dict[str, Signal]:
        """The signals of the law: those it states, its state, and its torque."""
        return {**self.law.signals, **self.law.states, **TORQUE_SIGNALS}

    def parameters(self) -> dict[str, Any]:
        """The parameter sets whose numbers are inputs of the tick, by path."""
        sets: dict[str, Any] = {"plant": self.plant, "testbed": self.testbed}
        return {**sets, "law": self.law} if is_parameters(self.law) else sets

    def parameter_values(self, absent: Container[str] = ()) -> np.ndarray:
        """Value of each parameter of the program, in its order."""
        sets = self.parameters().items()
        return np.concatenate([values_of(part, f"{name}.", absent) for name, part in sets])

    def parameter_rows(self, absent: Container[str] = ()) -> dict[str, slice]:
        """Where the values of each parameter stand among those of the program, by its path."""
        rows, first = {}, 0
        for name, part in self.parameters().items():
            for path, value, _ in numeric_fields(part, f"{name}."):
                if path not in absent:
                    rows[path] = slice(first, first + np.size(value))
                    first += np.size(value)
        return rows

    def zeros(self) -> frozenset[str]:
        """Paths of the parameters that are zero: of what they scale, nothing need be computed."""
        return frozenset(
            path
            for name, part in self.parameters().items()
            for path, value, _ in numeric_fields(part, f"{name}.")
            if not np.any(value)
        )

    def initial_column(self, start: InitialState) -> Any:
        """State of the program before the first tick."""
        q, q_dot = as_vector(start.q), as_vector(start.q_dot)
        plant = PlantState(q, q_dot, start.x_m, start.x_m_dot, 0.0)
        ago = plant._replace(q=q - self.dt * q_dot, x_m=start.x_m - self.dt * start.x_m_dot)
        before = self.testbed.readings(ago, 0.0)
        parts = [PLANT.pack(plant._asdict()), SENSORS.pack(before._asdict())]
        if not isinstance(self.law, PlainLaw):
            parts.append(self.law_layout.pack(dict(self.law.initial_state())))
        return concatenate(*parts, *([0.0, 0.0] if self.testbed.delay else []))


def advance(loop: ClosedLoop, s: PlantState, tau: Vector) -> PlantState:
    """State of the plant one sample later, under a held torque, each switch of contact located."""
    for _ in range(loop.substeps):
        s = split_step(loop, s, tau)
    return s


def split_step(loop: ClosedLoop, s: PlantState, tau: Vector) -> PlantState:
    """State of the plant after one of the integrator's steps, split at a switch of contact."""
    phases = phases_of(loop.plant, tau)
    column = phases.split_step(PLANT.pack(s._asdict()), loop.dt / loop.substeps)
    return _rested(PlantState(**PLANT.unpack(column)))


def _rested(s: PlantState) -> PlantState:
    """End the decay of the bristle before its numbers are subnormal: they cost a hundredfold."""
    return s._replace(z=where(fabs(s.z) < SMALLEST, 0.0, s.z))


def advance_in_phase(loop: ClosedLoop, s: PlantState, tau: Vector) -> tuple[PlantState, Scalar]:
    """What `advance` gives where no step meets a switch of contact, and 1 where one does."""
    column, dt, switched = PLANT.pack(s._asdict()), loop.dt / loop.substeps, 0.0
    phases = phases_of(loop.plant, tau)
    for _ in range(loop.substeps):
        column, within = phases.step(column, dt)
        switched = maximum(switched, within)
    return _rested(PlantState(**PLANT.unpack(column))), switched


def phases_of(plant: Plant, tau: Vector) -> Phases:
    """The plant as a system of two phases: contact that presses, and contact that does not."""

    def state(column: Any) -> PlantState:
        return PlantState(**PLANT.unpack(column))

    def rates(x: Any, torque: Vector, presses: Scalar) -> Any:
        return PLANT.pack(plant.rates(state(x), torque, presses)._asdict())

    moving = traced(rates, PLANT.size, 2, 1)
    return Phases(
        rates=lambda x, presses: moving(x, tau, presses),
        guard=traced(lambda x: plant.touch(state(x)).guard, PLANT.size),
    )


def plant_signals(loop: ClosedLoop, s: PlantState, tau_applied: Vector) -> dict[str, Any]:
    """Everything about the plant that is recorded."""
    arm, touch = loop.plant.arm, loop.plant.touch(s)
    J = arm.J(s.q)
    return {
        **s._asdict(),
        "x_r": arm.x_r(s.q),
        "x_r_dot": J @ s.q_dot,
        "gap": touch.gap,
        "Lambda": touch.Lambda,
        "F_m": touch.F_m,
        "F_t": touch.F_t,
        "probe_clearance": loop.testbed.probe.clearance - loop.plant.contact.penetration(touch.gap),
        "det_J": J[0, 0] * J[1, 1] - J[0, 1] * J[1, 0],
        "tau_applied": tau_applied,
    }


def torque_signals(tau: Vector, clipped: Vector) -> dict[str, Any]:
    """What is recorded of the torque that a law computes."""
    cut = (where(tau[i] == clipped[i], 0.0, 1.0) for i in range(2))
    return {"tau": tau, "clipped": vector(*cut)}


def _diverged(column: ca.SX) -> Scalar:
    """Trip when an entry of the plant state passes 1e6 in SI units."""
    within = ca.sum1(ca.fabs(column) <= 1e6)  # false for NaN
    return where(within < column.numel(), float(DIVERGED), 0.0)


def _no_torque(tau: Vector) -> Scalar:
    """Trip when a torque is no number: a clip would turn it into the limit without a word."""
    usable = (fabs(tau[0]) < 1e300) * (fabs(tau[1]) < 1e300)  # false for NaN
    return where(usable > 0, 0.0, float(NO_TORQUE))


def _lifted(
    loop: ClosedLoop, absent: Container[str] = ()
) -> tuple[ClosedLoop, ca.SX, tuple[str, ...]]:
    """The same loop on symbols, its parameters as one column, and their paths."""
    sets = loop.parameters().items()
    lifted = {name: lift(part, f"{name}.", absent) for name, part in sets}
    symbolic = ClosedLoop(
        plant=lifted["plant"].obj,
        testbed=lifted["testbed"].obj,
        law=lifted["law"].obj if "law" in lifted else loop.law,
        substeps=loop.substeps,
    )
    column = ca.vertcat(*(part.symbols for part in lifted.values()))
    return symbolic, column, tuple(path for part in lifted.values() for path in part.paths)


def check_channels(loop: ClosedLoop, channels: tuple[str, ...] | None) -> Layout:
    """Layout of the signals to record: the given ones, or all; refuse what is no signal."""
    known = loop.signals
    for name in channels or ():
        if name not in known:
            raise UnknownName("signal", name, known)
    return Layout({n: s for n, s in known.items() if channels is None or n in channels})


def tick_program(
    loop: ClosedLoop, channels: tuple[str, ...] | None = None, absent: Container[str] = ()
) -> Program:
    """Build the tick of a closed loop: state, noise and parameters in, next state and signals out.

    Parameters
    ----------
    loop : ClosedLoop
        With a law that takes expressions.
    channels : tuple of str, optional
        Signals to record; all of them if not given.
    absent : container of str
        Paths of parameters that are zero and stay so: they are no inputs, and the program does
        not compute what they scale.

    Raises
    ------
    UnknownName
        If a channel is no signal of this loop.
    """
    recorded = check_channels(loop, channels)
    symbolic, p, paths = _lifted(loop, absent)
    plant, before = ca.SX.sym("plant", PLANT.size), ca.SX.sym("sensors", SENSORS.size)
    memory = ca.SX.sym("law", loop.law_layout.size)
    held = ca.SX.sym("held", 2 if loop.testbed.delay else 0)
    noise = ca.SX.sym("noise")

    s = PlantState(**PLANT.unpack(plant))
    now = symbolic.testbed.readings(s, noise)
    measured = symbolic.testbed.measure(now, SensorState(**SENSORS.unpack(before)))
    state = loop.law_layout.unpack(memory)
    tick = symbolic.law.tick(state, measured, 1 / symbolic.testbed.sample_rate)
    clipped = symbolic.testbed.motors.clip(tick.tau)
    applied = held if loop.testbed.delay else clipped

    trial, switched = advance_in_phase(symbolic, s, applied)
    following = PLANT.pack(trial._asdict())
    values: Mapping[str, Any] = {
        **plant_signals(symbolic, s, applied),
        **{f"{name}_measured": value for name, value in measured._asdict().items()},
        **tick.signals,
        **state,
        **torque_signals(tick.tau, clipped),
    }
    outputs = recorded.pack({name: values[name] for name in recorded.signals})
    tripped = where(tick.trip > 0, tick.trip, maximum(_no_torque(tick.tau), _diverged(following)))
    x_next = ca.vertcat(
        following,
        SENSORS.pack(now._asdict()),
        loop.law_layout.pack(dict(tick.state)),
        clipped if loop.testbed.delay else ca.SX(0, 1),
    )
    x = ca.vertcat(plant, before, memory, held)
    usual = build(
        "usual",
        {"x": x, "w": noise, "p": p},
        {"x_next": x_next, "y": ca.vertcat(outputs, tripped), "tau": applied, "switched": switched},
    )
    return Program(usual, _located(symbolic, p), loop.substeps, recorded, paths)


def _located(symbolic: ClosedLoop, p: ca.SX) -> ca.Function:
    """A step of the plant in which contact switches."""
    plant, tau = ca.SX.sym("plant", PLANT.size), ca.SX.sym("tau", 2)
    after = split_step(symbolic, PlantState(**PLANT.unpack(plant)), tau)
    following = PLANT.pack(after._asdict())
    outputs = {"plant_next": following, "trip": _diverged(following)}
    return build("located", {"plant": plant, "tau": tau, "p": p}, outputs)


def initial_program(loop: ClosedLoop, start: InitialState, absent: Container[str]) -> ca.Function:
    """Build ``(start, p) -> x``: the state before the first tick, for many runs at once."""
    symbolic, p, _ = _lifted(loop, absent)
    begun = lift(start)
    x = symbolic.initial_column(begun.obj)
    return build("initial", {"start": begun.symbols, "p": p}, {"x": x})


def plain_programs(
    loop: ClosedLoop, absent: Container[str] = ()
) -> tuple[ca.Function, ca.Function]:
    """Build what surrounds a law in plain Python: the sensors, and the plant over a sample."""
    symbolic, p, _ = _lifted(loop, absent)
    plant, before = ca.SX.sym("plant", PLANT.size), ca.SX.sym("sensors", SENSORS.size)
    noise, tau = ca.SX.sym("noise"), vector(ca.SX.sym("tau1"), ca.SX.sym("tau2"))
    s = PlantState(**PLANT.unpack(plant))
    now = symbolic.testbed.readings(s, noise)
    measured = symbolic.testbed.measure(now, SensorState(**SENSORS.unpack(before)))
    sense = build(
        "sense",
        {"plant": plant, "sensors": before, "w": noise, "p": p},
        {"sensors_next": SENSORS.pack(now._asdict()), "measured": ca.vertcat(*measured)},
    )
    following = PLANT.pack(advance(symbolic, s, tau)._asdict())
    signals = Layout(PLANT_SIGNALS).pack(plant_signals(symbolic, s, tau))
    move = build(
        "move",
        {"plant": plant, "tau": tau, "p": p},
        {"plant_next": following, "signals": signals, "trip": _diverged(following)},
    )
    return sense, move
