"""The law of [27]: the same error system with known parameters."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from alight.control.measurement import Measurement
from alight.control.transition import ContactTransitionLaw, Flow
from alight.symbolic.ops import Scalar, Vector, as_vector, tanh
from alight.symbolic.parameters import parameters
from alight.symbolic.signals import Signal


@parameters
class ExactModel(ContactTransitionLaw):
    """Exact model knowledge: the parameters of ``model`` stand where (32) has estimates.

    Dupree, Dixon, Hu and Liang, ACC 2006, pp. 3241-3246 ([27]), whose feedback is that of (44).
    """

    states: ClassVar[Mapping[str, Signal]] = {"u_f": Signal("", "filter state tanh(e_f), (18)")}

    def feedback(self, e_r: Vector, r_r: Vector) -> Vector:
        """``e_r + k3 r_r`` [N]."""
        return e_r + as_vector(self.gains.k3) * r_r

    def theta_dk_hat_dot(self, x_m: Scalar, eta_m: Scalar, theta_dk_hat: Scalar) -> Scalar:
        """Zero: ``k_s / K_I`` is known."""
        return 0.0 * theta_dk_hat

    def initial_state(self) -> dict[str, Any]:
        """Filter at its start."""
        return {"u_f": tanh(self.e_f)}

    def flow(self, state: Mapping[str, Any], measured: Measurement) -> Flow:
        """The force (31) of the model plus feedback, and the rate (18)."""
        e = self.errors(measured, state["u_f"], self.model.theta_dk)
        feedforward = self.W(self.pi_of(self.model), measured, e)
        return self.command(measured, e, feedforward, {"u_f": e.u_f_dot})
