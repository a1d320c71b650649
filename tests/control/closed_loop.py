"""Every signal of a closed loop at one state, rates by differentiation along its vector field."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from alight.control import AdaptiveContactLaw, AdaptiveState, Measurement
from alight.models import PlantState
from alight.symbolic.derive import jacobian, time_derivative
from alight.theory import V, V_r
from tests.control.cases import Case
from tests.lifted import Evaluate, lifted
from tests.strategies import Plane

Read = Callable[[PlantState, AdaptiveState], Any]


def measured(s: PlantState) -> Measurement:
    """What perfect sensors show."""
    return Measurement(s.q, s.q_dot, s.x_m, s.x_m_dot)


def signals(law: AdaptiveContactLaw, *state: Any) -> dict[str, Any]:
    """Signals of a law in the loop with the plant that it is told of.

    ``state`` holds the entries of the plant's state but the bristle, then those of the law's.
    """
    plant = law.model

    def parts(*state: Any) -> tuple[PlantState, AdaptiveState]:
        return PlantState(*state[:4], 0.0), AdaptiveState(*state[4:])

    s, a = parts(*state)
    flow = law.flow(a._asdict(), measured(s))
    moving, learning = plant.rates(s, flow.tau), AdaptiveState(**flow.rates)

    def along(read: Read) -> Any:
        def of_state(*state: Any) -> Any:
            return read(*parts(*state))

        return time_derivative(of_state, state, [*moving[:4], *learning], constants=law)

    def errors(s: PlantState, a: AdaptiveState) -> Any:
        return law.errors(measured(s), a.u_f, a.theta_dk_hat)

    e, arm = errors(s, a), plant.arm
    mu = law.gains.Gamma * plant.body.Y_d(s.x_m) * e.eta_m
    return {
        **e._asdict(),
        **flow.signals,
        "tau": flow.tau,
        "M_bar": arm.M_bar(s.q),
        "C_bar": arm.C_bar(s.q, s.q_dot),
        "h_bar": arm.h_bar(s.q),
        "J": arm.J(s.q),
        "J_dot": arm.J_dot(s.q, s.q_dot),
        "F_m": plant.touch(s).F_m,
        "x_m_ddot": moving.x_m_dot,
        "theta_r_hat_dot": learning.theta_r_hat,
        "x_rd1_ddot": law.x_rd1_ddot(s.x_m, s.x_m_dot, a.u_f, a.theta_dk_hat, moving.x_m_dot),
        "Y_r": law.Y_r(measured(s), e),
        "W": law.W(law.pi_of(plant), measured(s), e),
        "theta_r": law.theta_r_of(law.pi_of(plant)),
        "P_mu": jacobian(lambda v: law.theta_dk.project(v, a.theta_dk_hat), mu),
        "P_theta": jacobian(lambda v: law.theta_dk.project(mu, v), a.theta_dk_hat),
        "along_e_m": along(lambda s, a: errors(s, a).e_m),
        "along_e_r": along(lambda s, a: errors(s, a).e_r),
        "along_eta_m": along(lambda s, a: errors(s, a).eta_m),
        "along_x_rd": along(lambda s, a: errors(s, a).x_rd),
        "along_x_rd_dot": along(lambda s, a: errors(s, a).x_rd_dot),
        "along_r_r": along(lambda s, a: errors(s, a).r_r),
        "V": V(plant, law, s, a),
        "V_r": V_r(plant, law, s, a),
        "V_dot": along(lambda s, a: V(plant, law, s, a)),
        "V_r_dot": along(lambda s, a: V_r(plant, law, s, a)),
    }


_BUILT: dict[tuple[type, Plane], Evaluate] = {}


def evaluate(case: Case) -> dict[str, Any]:
    """Value of every entry of `signals` at a case: floats and arrays."""
    kind = type(case.law), case.law.model.arm.plane
    state = {**case.s._asdict(), **case.a._asdict()}
    del state["z"]
    if kind not in _BUILT:
        sizes = {f"at_{name}": int(np.size(value)) for name, value in state.items()}
        _BUILT[kind] = lifted(case.law, sizes, signals)
    found = _BUILT[kind](case.law, *state.values())
    return {name: float(v[0]) if v.size == 1 else v for name, v in found.items()}
