"""What every law on the paper's error system shares: (16)-(18), (25), (45), (46) and (31)."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, NamedTuple

from alight.control import error_system
from alight.control.gains import Gains, Target
from alight.control.law import Law, Tick
from alight.control.measurement import Measurement
from alight.models import LinearSpring, MassSpring, Plant
from alight.symbolic.derive import time_derivative
from alight.symbolic.ops import Scalar, Vector, as_vector, fabs, tanh, vector, where
from alight.symbolic.parameters import Quantity, parameters, rebind
from alight.symbolic.signals import Signal

FILTER_TRIP = 1


class Errors(NamedTuple):
    """Signals of the error system at one instant."""

    u_f: Scalar
    theta_dk_hat: Scalar
    x_r: Vector
    x_r_dot: Vector
    gap: Scalar
    e_m: Scalar
    eta_m: Scalar
    u_f_dot: Scalar
    theta_dk_hat_dot: Scalar
    x_rd: Vector
    x_rd_dot: Vector
    e_r: Vector
    e_r_dot: Vector
    r_r: Vector


class Flow(NamedTuple):
    """A law in continuous time."""

    tau: Vector
    """Joint torques ``J^T F`` [N m], shape (2,)."""
    rates: Mapping[str, Any]
    """Rates of the law's state, by name."""
    signals: Mapping[str, Any]
    """Signals to record, by name."""


@parameters
class ContactTransitionLaw(Law):
    """A law on the error system of Section III: a subclass states estimates and feedback.

    ``model`` is what the law is told of the plant.
    """

    model: Plant
    target: Target
    gains: Gains
    e_f: Annotated[float, Quantity("", "filter variable e_f at the start, (18)")] = 0.0

    signals: ClassVar[Mapping[str, Signal]] = {
        "e_m": Signal("m", "position error of the mass, (16)"),
        "e_r": Signal("m", "position error of the tip, (16)", 2),
        "r_r": Signal("m/s", "filtered tracking error of the tip, (17)", 2),
        "eta_m": Signal("m/s", "filtered error of the mass, (17)"),
        "x_rd": Signal("m", "desired tip position, (25)", 2),
        "x_rd_dot": Signal("m/s", "rate of the desired tip position, (45)", 2),
        "F": Signal("N", "commanded tip force, (32) or (44)", 2),
        "F_feedforward": Signal("N", "model-based part of the commanded force, (31)", 2),
    }
    trips: ClassVar[Mapping[int, str]] = {
        FILTER_TRIP: "the filter state u_f = tanh(e_f) reached 1: e_f escaped to infinity"
    }

    @abstractmethod
    def feedback(self, e_r: Vector, r_r: Vector) -> Vector:
        """Feedback force [N], shape (2,): what (32) and (44) differ in."""

    # The desired trajectory, (25), (45), (46)

    def x_rd1(self, x_m: Scalar, u_f: Scalar, theta_dk_hat: Scalar) -> Scalar:
        """Desired tip position along X1, (25) [m]."""
        g = self.gains
        reach = g.k2 * tanh(self.target.x_md - x_m)
        damping = g.k1 * g.k2 * error_system.cosh2_tanh(u_f)
        return self.model.body.Y_d(x_m) * theta_dk_hat + x_m + reach - damping

    @abstractmethod
    def theta_dk_hat_dot(self, x_m: Scalar, eta_m: Scalar, theta_dk_hat: Scalar) -> Scalar:
        """Rate of the estimate of ``k_s / K_I``, (27); zero where it is known."""

    def filter_rates(
        self, x_m: Scalar, x_m_dot: Scalar, u_f: Scalar, theta_dk_hat: Scalar
    ) -> tuple[Scalar, Scalar, Scalar]:
        """Filtered error ``eta_m`` (17) [m/s], and the rates (18) and (27)."""
        e_m = self.target.x_md - x_m
        eta_m = error_system.eta_m(self.gains, e_m, x_m_dot, u_f)
        u_f_dot = error_system.u_f_dot(self.gains, e_m, eta_m, u_f)
        return eta_m, u_f_dot, self.theta_dk_hat_dot(x_m, eta_m, theta_dk_hat)

    def x_rd1_dot(self, x_m: Scalar, x_m_dot: Scalar, u_f: Scalar, theta_dk_hat: Scalar) -> Scalar:
        """Rate of (25) along (18) and (27) [m/s]: the paper's (45)."""
        _, u_f_dot, theta_dot = self.filter_rates(x_m, x_m_dot, u_f, theta_dk_hat)
        return time_derivative(
            self.x_rd1, [x_m, u_f, theta_dk_hat], [x_m_dot, u_f_dot, theta_dot], constants=self
        )

    def x_rd1_ddot(
        self, x_m: Scalar, x_m_dot: Scalar, u_f: Scalar, theta_dk_hat: Scalar, x_m_ddot: Scalar
    ) -> Scalar:
        """Rate of (45) [m/s^2] for a given acceleration of the mass: (46), with erratum E2."""
        _, u_f_dot, theta_dot = self.filter_rates(x_m, x_m_dot, u_f, theta_dk_hat)
        return time_derivative(
            self.x_rd1_dot,
            [x_m, x_m_dot, u_f, theta_dk_hat],
            [x_m_dot, x_m_ddot, u_f_dot, theta_dot],
            constants=self,
        )

    # The error system (16)-(18) and the force that it needs (31)

    def errors(self, measured: Measurement, u_f: Scalar, theta_dk_hat: Scalar) -> Errors:
        """Signals of (16)-(18) and (25) from a measurement."""
        arm, g = self.model.arm, self.gains
        x_r, x_r_dot = arm.x_r(measured.q), arm.J(measured.q) @ measured.q_dot
        filtered = (measured.x_m, measured.x_m_dot, u_f, theta_dk_hat)
        eta_m, u_f_dot, theta_dk_hat_dot = self.filter_rates(*filtered)
        x_rd = vector(self.x_rd1(measured.x_m, u_f, theta_dk_hat), self.target.x_rd2)
        x_rd_dot = vector(self.x_rd1_dot(*filtered), 0.0)
        e_r, e_r_dot = x_rd - x_r, x_rd_dot - x_r_dot
        return Errors(
            u_f=u_f,
            theta_dk_hat=theta_dk_hat,
            x_r=x_r,
            x_r_dot=x_r_dot,
            gap=x_r[0] - measured.x_m,
            e_m=self.target.x_md - measured.x_m,
            eta_m=eta_m,
            u_f_dot=u_f_dot,
            theta_dk_hat_dot=theta_dk_hat_dot,
            x_rd=x_rd,
            x_rd_dot=x_rd_dot,
            e_r=e_r,
            e_r_dot=e_r_dot,
            r_r=error_system.r_r(g, e_r, e_r_dot),
        )

    def pi_of(self, plant: Plant) -> Vector:
        """``pi`` of a plant, in the order of `theta_r_of`."""
        arm, body, K_I = plant.arm, plant.body, plant.contact.K_I
        inertia = [getattr(arm, name) for name in arm.inertial + arm.gravitational]
        return vector(*inertia, K_I / body.m, body.k_s / body.m, K_I)

    def W(self, pi: Vector, measured: Measurement, e: Errors) -> Vector:
        """Force (31) [N], shape (2,), that a plant with parameters ``pi`` needs.

        With diagonal ``alpha`` the order is ``M_bar alpha e_r_dot`` (erratum E1).
        """
        known = self.model.arm
        arm = known.with_inertia(pi[: len(known.inertial + known.gravitational)])
        count = len(known.inertial + known.gravitational)
        unit_body = MassSpring(m=1.0, k_s=1.0, x_0=0.0)
        body = rebind(unit_body, k_s=pi[count + 1], x_0=self.model.body.x_0)
        spring = LinearSpring()
        presses = spring.Lambda(e.gap)  # not the guard: it may read K_I, which is a symbol here
        pushed = rebind(spring, K_I=pi[count]).force(e.gap, 0.0, presses)
        x_m_ddot = body.acceleration(measured.x_m, measured.x_m_dot, pushed)
        x_rd1_ddot = self.x_rd1_ddot(
            measured.x_m, measured.x_m_dot, e.u_f, e.theta_dk_hat, x_m_ddot
        )
        alpha = as_vector(self.gains.alpha)
        acceleration = vector(x_rd1_ddot, 0.0) + alpha * e.e_r_dot
        velocity = e.x_rd_dot + alpha * e.e_r
        impact = rebind(spring, K_I=pi[-1]).force(e.gap, 0.0, presses)
        return (
            arm.M_bar(measured.q) @ acceleration
            + arm.C_bar(measured.q, measured.q_dot) @ velocity
            + arm.h_bar(measured.q)
            + vector(impact, 0.0)
        )

    # From continuous time to a sample

    @abstractmethod
    def flow(self, state: Mapping[str, Any], measured: Measurement) -> Flow:
        """The law in continuous time, as the paper states it."""

    def command(
        self, measured: Measurement, e: Errors, feedforward: Vector, rates: Mapping[str, Any]
    ) -> Flow:
        """Force and torque from the model-based part and the feedback."""
        F = feedforward + self.feedback(e.e_r, e.r_r)
        known = {**e._asdict(), "F": F, "F_feedforward": feedforward}
        return Flow(
            tau=self.model.arm.J(measured.q).T @ F,
            rates=rates,
            signals={name: known[name] for name in self.signals},
        )

    def step(
        self, state: Mapping[str, Any], rates: Mapping[str, Any], dt: Scalar
    ) -> dict[str, Any]:
        """Euler step of the law's state over a sample time ``dt`` [s]."""
        return {name: state[name] + dt * rates[name] for name in self.states}

    def tick(self, state: Mapping[str, Any], measured: Measurement, dt: Scalar) -> Tick:
        """One sample: the torque now, and a step to the next state."""
        flow = self.flow(state, measured)
        following = self.step(state, flow.rates, dt)
        trip = where(fabs(following["u_f"]) >= 1, float(FILTER_TRIP), 0.0)
        return Tick(flow.tau, following, flow.signals, trip)
