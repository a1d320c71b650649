"""Plant, testbed and law joined to one tick: the function that is simulated and deployed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

import casadi as ca
import numpy as np

from alight.control.law import Law, PlainLaw
from alight.control.measurement import Measurement
from alight.errors import UnknownName
from alight.kernels.program import Program
from alight.models import Plant, PlantState
from alight.simulation.integrate import rk4_step
from alight.symbolic.build import build
from alight.symbolic.ops import Scalar, Vector, fabs, maximum, vector, where
from alight.symbolic.parameters import Quantity, is_parameters, lift, parameters, values_of
from alight.symbolic.signals import Layout, Signal
from alight.testbed import SensorState, Testbed

PLANT = Layout.of(PlantState)
SENSORS = Layout.of(SensorState)
DIVERGED, NO_TORQUE = 101, 102
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
        torque = {"tau": Signal("N m", "torque computed by the law", 2)}
        return {**self.law.signals, **self.law.states, **torque}

    def parameters(self) -> dict[str, Any]:
        """The parameter sets whose numbers are inputs of the tick, by path."""
        sets: dict[str, Any] = {"plant": self.plant, "testbed": self.testbed}
        return {**sets, "law": self.law} if is_parameters(self.law) else sets

    def parameter_values(self) -> np.ndarray:
        """Value of each parameter of the program, in its order."""
        return np.concatenate([values_of(part) for part in self.parameters().values()])

    def initial_column(self, start: InitialState) -> np.ndarray:
        """State of the program before the first tick."""
        plant = PlantState(np.array(start.q), np.array(start.q_dot), start.x_m, start.x_m_dot, 0.0)
        ago = plant._replace(
            q=plant.q - self.dt * plant.q_dot, x_m=start.x_m - self.dt * start.x_m_dot
        )
        before = self.testbed.readings(ago, 0.0)
        parts = [PLANT.pack(plant._asdict()), SENSORS.pack(before._asdict())]
        if not isinstance(self.law, PlainLaw):
            parts.append(self.law_layout.pack(dict(self.law.initial_state())))
        return np.concatenate([*parts, np.zeros(2 if self.testbed.delay else 0)])


def advance(loop: ClosedLoop, s: PlantState, tau: Vector) -> PlantState:
    """State of the plant one sample later, under a held torque."""
    dt = 1 / (loop.testbed.sample_rate * loop.substeps)

    def rates(column: Any) -> Any:
        return PLANT.pack(loop.plant.rates(PlantState(**PLANT.unpack(column)), tau)._asdict())

    column = PLANT.pack(s._asdict())
    for _ in range(loop.substeps):
        column = rk4_step(rates, column, dt)
    return PlantState(**PLANT.unpack(column))


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


def _diverged(column: ca.SX) -> Scalar:
    """Trip when an entry of the plant state passes 1e6 in SI units."""
    within = ca.sum1(ca.fabs(column) <= 1e6)  # false for NaN
    return where(within < column.numel(), float(DIVERGED), 0.0)


def _no_torque(tau: Vector) -> Scalar:
    """Trip when a torque is no number: a clip would turn it into the limit without a word."""
    usable = (fabs(tau[0]) < 1e300) * (fabs(tau[1]) < 1e300)  # false for NaN
    return where(usable > 0, 0.0, float(NO_TORQUE))


def _lifted(loop: ClosedLoop) -> tuple[ClosedLoop, ca.SX, tuple[str, ...]]:
    """The same loop on symbols, its parameters as one column, and their paths."""
    lifted = {name: lift(part, f"{name}.") for name, part in loop.parameters().items()}
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


def tick_program(loop: ClosedLoop, channels: tuple[str, ...] | None = None) -> Program:
    """Build the tick of a closed loop: state, noise and parameters in, next state and signals out.

    Parameters
    ----------
    loop : ClosedLoop
        With a law that takes expressions.
    channels : tuple of str, optional
        Signals to record; all of them if absent.

    Raises
    ------
    UnknownName
        If a channel is no signal of this loop.
    """
    recorded = check_channels(loop, channels)
    symbolic, p, paths = _lifted(loop)
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

    following = PLANT.pack(advance(symbolic, s, applied)._asdict())
    values: Mapping[str, Any] = {
        **plant_signals(symbolic, s, applied),
        **{f"{name}_measured": value for name, value in measured._asdict().items()},
        **tick.signals,
        **state,
        "tau": tick.tau,
    }
    outputs = recorded.pack({name: values[name] for name in recorded.signals})
    tripped = where(tick.trip > 0, tick.trip, maximum(_no_torque(tick.tau), _diverged(following)))
    x_next = ca.vertcat(
        following,
        SENSORS.pack(now._asdict()),
        loop.law_layout.pack(dict(tick.state)),
        clipped if loop.testbed.delay else ca.SX(0, 1),
    )
    function = build(
        "tick",
        {"x": ca.vertcat(plant, before, memory, held), "w": noise, "p": p},
        {"x_next": x_next, "y": ca.vertcat(outputs, tripped)},
    )
    return Program(function, recorded, paths)


def plain_programs(loop: ClosedLoop) -> tuple[ca.Function, ca.Function]:
    """Build what surrounds a law in plain Python: the sensors, and the plant over a sample."""
    symbolic, p, _ = _lifted(loop)
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
