"""What (32) and (44) share: the adaptive law of Section III without its feedback term."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import field
from typing import Annotated, Any, NamedTuple

from alight.control.measurement import Measurement
from alight.control.projection import Estimate
from alight.control.transition import ContactTransitionLaw, Errors, Flow
from alight.errors import AlightError
from alight.symbolic.derive import regressor
from alight.symbolic.ops import Matrix, Scalar, Vector, as_vector, tanh, vector
from alight.symbolic.parameters import Positive, Quantity, parameters
from alight.symbolic.signals import Layout, Signal


class AdaptiveState(NamedTuple):
    """State of an adaptive law."""

    u_f: Annotated[Any, Signal("", "filter state tanh(e_f), (18)")]
    theta_dk_hat: Annotated[Any, Signal("", "estimate of k_s / K_I, (27)")]
    theta_r_hat: Annotated[Any, Signal("mixed", "estimate of theta_r, (33)", 10)]


@parameters
class AdaptiveContactLaw(ContactTransitionLaw):
    """Adaptive law of Section III; a subclass states its feedback term.

    Of ``model`` an adaptive law reads the link lengths and the rest position ``x_0`` only.
    """

    Gamma_r: Annotated[tuple[Positive, ...], Quantity("mixed", "adaptation gains of (33)")] = field(
        kw_only=True
    )
    theta_dk: Estimate = field(kw_only=True)
    theta_r: Estimate = field(kw_only=True)

    def potential(self, e_r: Vector) -> Scalar:
        """Energy [J] whose slope is the feedback of a position error without velocity error.

        It stands in the Lyapunov function; a law of your own needs it for a certificate only.

        Raises
        ------
        AlightError
            If the law does not state it.
        """
        raise AlightError(
            f"{type(self).__name__} does not state its potential(e_r), whose slope is "
            "feedback(e_r, 0): without it there is no Lyapunov function"
        )

    def __post_init__(self) -> None:
        entries = self._entries
        given = {"Gamma_r": self.Gamma_r, "theta_r.initial": self.theta_r.initial}
        for name, value in given.items():
            if not isinstance(value, tuple) or len(value) != entries:
                given_entries = len(value) if isinstance(value, tuple) else 1
                raise ValueError(
                    f"{name} needs {entries} entries, one for each of theta_r, and has "
                    f"{given_entries}"
                )
        if isinstance(self.theta_dk.initial, tuple):
            raise ValueError("theta_dk.initial must be one number")

    @property
    def _entries(self) -> int:
        """Number of entries of ``theta_r``."""
        return len(self.model.arm.gravitational) + 10

    @property
    def states(self) -> Mapping[str, Signal]:  # type: ignore[override]
        """The law's state; ``theta_r_hat`` has more entries than ten in a vertical plane."""
        signals = Layout.of(AdaptiveState).signals
        return {
            **signals,
            "theta_r_hat": dataclasses.replace(signals["theta_r_hat"], size=self._entries),
        }

    def initial_state(self) -> dict[str, Any]:
        """Filter and estimates at their start."""
        return AdaptiveState(
            tanh(self.e_f), self.theta_dk.initial, as_vector(self.theta_r.initial)
        )._asdict()

    def mu_dk(self, x_m: Scalar, eta_m: Scalar) -> Scalar:
        """Rate of the estimate of ``k_s / K_I`` before projection, ``Gamma Y_d eta_m`` of (27)."""
        return self.gains.Gamma * self.model.body.Y_d(x_m) * eta_m

    def theta_dk_hat_dot(self, x_m: Scalar, eta_m: Scalar, theta_dk_hat: Scalar) -> Scalar:
        """Rate of the estimate of ``k_s / K_I``, (27), projected."""
        return self.theta_dk.project(self.mu_dk(x_m, eta_m), theta_dk_hat)

    def theta_r_of(self, pi: Vector) -> Vector:
        """``theta_r`` of (31) from ``pi``: (43)'s ten entries, then those of gravity if any.

        ``pi`` holds the inertial parameters of the arm, those of gravity, ``K_I / m``,
        ``k_s / m`` and ``K_I``.
        """
        arm = self.model.arm
        inertial, gravity = len(arm.inertial), len(arm.gravitational)
        kappa, sigma, K_I = pi[inertial + gravity], pi[inertial + gravity + 1], pi[-1]
        blocks = [(pi[j] * kappa, pi[j] * sigma, pi[j]) for j in range(inertial)]
        weights = [pi[inertial + j] for j in range(gravity)]
        return vector(*(entry for block in blocks for entry in block), K_I, *weights)

    def Y_r(self, measured: Measurement, e: Errors) -> Matrix:
        """Regressor of (31), 2 x 10: the Jacobian of `W` with respect to ``theta_r``."""
        arm = self.model.arm
        return regressor(
            lambda pi: self.W(pi, measured, e),
            self.theta_r_of,
            len(arm.inertial + arm.gravitational) + 3,
        )

    def mu_r(self, Y_r: Matrix, r_r: Vector) -> Vector:
        """Rate of the estimate of ``theta_r`` before projection, ``Gamma_r Y_r^T r_r`` of (33)."""
        return as_vector(self.Gamma_r) * (Y_r.T @ r_r)

    def theta_r_hat_dot(self, Y_r: Matrix, r_r: Vector, theta_r_hat: Vector) -> Vector:
        """Rate of the estimate of ``theta_r``, (33), projected."""
        return self.theta_r.project(self.mu_r(Y_r, r_r), theta_r_hat)

    def flow(self, state: Mapping[str, Any], measured: Measurement) -> Flow:
        """Force (32) or (44), and the rates (18), (27) and (33)."""
        s = AdaptiveState(**state)
        e = self.errors(measured, s.u_f, s.theta_dk_hat)
        Y_r = self.Y_r(measured, e)
        rates = AdaptiveState(
            u_f=e.u_f_dot,
            theta_dk_hat=e.theta_dk_hat_dot,
            theta_r_hat=self.theta_r_hat_dot(Y_r, e.r_r, s.theta_r_hat),
        )
        return self.command(measured, e, Y_r @ s.theta_r_hat, rates._asdict())

    def step(
        self, state: Mapping[str, Any], rates: Mapping[str, Any], dt: Scalar
    ) -> dict[str, Any]:
        """Euler step; the estimates are clipped to their widened bounds."""
        following = super().step(state, rates, dt)
        return {
            **following,
            "theta_dk_hat": self.theta_dk.clip(following["theta_dk_hat"]),
            "theta_r_hat": self.theta_r.clip(following["theta_r_hat"]),
        }
