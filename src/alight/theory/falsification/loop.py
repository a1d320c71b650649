"""Closed loops to attack: any law, plant and state that the propositions admit, from coordinates.

The true parameters lie in their boxes, the estimates in the widened ones, the filter in its domain
and the pose where ``J`` is regular; nothing else is asked of design or state.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Literal

import casadi as ca
import numpy as np

from alight.control import AdaptiveContactLaw, AdaptiveState, ForceLimiting
from alight.control.transition import Errors
from alight.models import PlantState
from alight.scenarios import load_scenario
from alight.simulation.continuous import continuous_rates, join_state, split_state
from alight.symbolic.derive import jacobian
from alight.symbolic.ops import as_vector
from alight.symbolic.parameters import rebind
from alight.theory.falsification.judged import Expressions
from alight.theory.falsification.space import Range, Space, both, inside, linear, log
from alight.theory.lossless import lossless
from alight.theory.lyapunov import errors_at

Plane = Literal["horizontal", "vertical"]

DESIGN: dict[str, Range] = {
    **{name: log(0.05, 2.0) for name in ("l1", "l2")},
    **{name: log(1e-3, 1e1) for name in ("p2", "p1_beyond_p2")},
    "p3_share": linear(-0.99, 0.99),
    "m": log(1e-2, 1e3),
    "K_I": log(1e0, 1e7),
    "k_s": log(1e-1, 1e5),
    **{name: log(1e-3, 1e3) for name in ("k1", "k2", "alpha1", "alpha2", "alpha3")},
    **{name: log(1e-3, 1e4) for name in ("k3_1", "k3_2", "alpha_1", "alpha_2", "Gamma")},
    "x_rd2": linear(-1.0, 1.0),
    **{name: log(1e-3, 1e1) for name in ("margin", "leak")},
}
"""Plant and gains; ``p3`` as a share of what keeps ``M`` positive definite."""
STATE: dict[str, Range] = {
    **{name: linear(-np.pi, np.pi) for name in ("q1", "q2")},
    **{name: both(1e-4, 1e2) for name in ("q1_dot", "q2_dot", "x_m_dot")},
    "e_m": both(1e-6, 5.0),
    "Y_d": both(1e-6, 1.0),
    "gap": both(1e-9, 1e1),
    "u_f": inside(),
}
"""State of plant and filter; ``e_m``, ``Y_d`` and ``gap`` place target, spring and mass."""


def estimated(name: str) -> dict[str, Range]:
    """Box of an estimate as shares of the truth below and above it, and where the estimate is."""
    return {
        f"below_{name}": log(1e-3, 1.0),
        f"above_{name}": log(1e-3, 1e2),
        f"hat_{name}": linear(0.0, 1.0),
    }


@dataclass(frozen=True)
class Loop:
    """A closed loop at a state; its numbers may be expressions."""

    law: AdaptiveContactLaw
    s: PlantState
    a: AdaptiveState

    @property
    def e(self) -> Errors:
        """Errors at the state."""
        return errors_at(self.law, self.s, self.a)

    def rate(self, of: Callable[..., Any]) -> Any:
        """Parts of the rate of ``of(plant, law, s, a)`` along the loop, one for each state."""
        column = join_state(self.law, self.s, self.a._asdict())
        moving, _ = continuous_rates(self.law.model, self.law, column)

        def value(x: Any) -> Any:
            s, memory = split_state(self.law, x)
            return of(self.law.model, self.law, s, AdaptiveState(**memory))

        return jacobian(value, column).T * moving


ERRORS: dict[str, Range] = {
    **{name: both(1e-6, 1e3) for name in ("r_r1", "r_r2", "eta_m")},
    **{name: both(1e-6, 1e1) for name in ("e_r1", "e_r2")},
}
"""Errors in place of the velocities, the gap and the second target."""


def entries(plane: Plane) -> int:
    """Number of entries of ``theta_r``."""
    return 10 if plane == "horizontal" else 12


def loops(ranges: Mapping[str, Range] = MappingProxyType({}), plane: Plane = "horizontal") -> Space:
    """Every loop; ``ranges`` replace those of some coordinates."""
    weights = {"g1": log(1e-2, 1e3), "g2": log(1e-2, 1e3)} if plane == "vertical" else {}
    boxes = [f"r{i + 1}" for i in range(entries(plane))]
    speeds = {f"Gamma_{name}": log(1e-8, 1e4) for name in boxes}
    estimates = {key: r for name in ("dk", *boxes) for key, r in estimated(name).items()}
    return Space({**DESIGN, **weights, **STATE, **speeds, **estimates, **ranges})


def errors(ranges: Mapping[str, Range] = MappingProxyType({})) -> Space:
    """Every loop, by its errors; ``ranges`` replace those of some coordinates."""
    placed_by_them = ("q1_dot", "q2_dot", "x_m_dot", "gap", "x_rd2")
    plain = {name: r for name, r in loops().ranges.items() if name not in placed_by_them}
    return Space({**plain, **ERRORS, **ranges})


def at_errors(c: Expressions, cls: type[AdaptiveContactLaw] = ForceLimiting) -> Loop:
    """The loop in which the errors are as given; velocities, gap and ``x_rd2`` follow."""
    zero = ca.SX(0)
    still = {name: zero for name in ("q1_dot", "q2_dot", "x_m_dot", "gap", "x_rd2")}
    x_m_dot = assembled({**c, **still}, cls).e.eta_m - c["eta_m"]
    before = assembled({**c, **still, "x_m_dot": x_m_dot}, cls)
    arm, q, e = before.law.model.arm, before.s.q, before.e
    e_r, r_r = (ca.vertcat(c[f"{name}1"], c[f"{name}2"]) for name in ("e_r", "r_r"))
    q_dot = ca.inv_minor(arm.J(q)) @ (e.x_rd_dot + as_vector(before.law.gains.alpha) * e_r - r_r)
    moved = {
        "x_m_dot": x_m_dot,
        "gap": e.x_rd[0] - before.s.x_m - c["e_r1"],
        "x_rd2": arm.x_r(q)[1] + c["e_r2"],
        "q1_dot": q_dot[0],
        "q2_dot": q_dot[1],
    }
    return assembled({**c, **moved}, cls)


def assembled(
    c: Expressions, cls: type[AdaptiveContactLaw] = ForceLimiting, outside: float = 0.0
) -> Loop:
    """The loop at some coordinates; ``outside`` moves the truth out of its boxes, by that share."""
    template = load_scenario("experiment-1").law
    assert isinstance(template, AdaptiveContactLaw)
    plain = lossless(template.model)
    coupling = c["p3_share"] * ca.sqrt(c["p1_beyond_p2"] * c["p2"])
    gravity = {name: c[name] for name in ("g1", "g2") if name in c}
    arm = rebind(
        plain.arm,
        plane="vertical" if gravity else "horizontal",
        **gravity,
        **{name: c[name] for name in ("l1", "l2", "p2")},
        p1=c["p2"] + c["p1_beyond_p2"],
        p3=coupling,
    )
    q = ca.vertcat(c["q1"], c["q2"])
    x_m = arm.x_r(q)[0] - c["gap"]
    body = rebind(plain.body, m=c["m"], k_s=c["k_s"], x_0=x_m - c["Y_d"])
    plant = rebind(plain, arm=arm, body=body, contact=rebind(plain.contact, K_I=c["K_I"]))
    made = rebind(
        object.__new__(cls),
        model=plant,
        target=rebind(template.target, x_md=x_m + c["e_m"], x_rd2=c["x_rd2"]),
        gains=_gains(template, c),
        e_f=0.0,
    )
    truth = made.theta_r_of(made.pi_of(plant))
    names = [f"r{i + 1}" for i in range(truth.numel())]
    theta_r, theta_r_hat = placed(template.theta_r, c, truth, names, outside)
    theta_dk, theta_dk_hat = placed(template.theta_dk, c, plant.theta_dk, ["dk"], outside)
    speeds = ca.vertcat(*(c[f"Gamma_{name}"] for name in names))
    law = rebind(made, Gamma_r=speeds * truth**2, theta_dk=theta_dk, theta_r=theta_r)
    s = PlantState(q, ca.vertcat(c["q1_dot"], c["q2_dot"]), x_m, c["x_m_dot"], 0.0)
    return Loop(law, s, AdaptiveState(c["u_f"], theta_dk_hat, theta_r_hat))


def _gains(template: AdaptiveContactLaw, c: Expressions) -> Any:
    plain = ("k1", "k2", "alpha1", "alpha2", "alpha3", "Gamma")
    return rebind(
        template.gains,
        **{name: c[name] for name in plain},
        k3=ca.vertcat(c["k3_1"], c["k3_2"]),
        alpha=ca.vertcat(c["alpha_1"], c["alpha_2"]),
    )


def placed(
    template: Any, c: Expressions, truth: Any, names: list[str], outside: float = 0.0
) -> tuple[Any, Any]:
    """Bounds that hold the truth, and an estimate in the widened interval."""
    below, above, share = (
        ca.vertcat(*(c[f"{side}_{name}"] for name in names)) for side in ("below", "above", "hat")
    )
    lower, upper = truth - below * ca.fabs(truth), truth + above * ca.fabs(truth)
    shift = truth - lower + outside * (upper - lower) if outside else 0.0
    lower, upper = lower + shift, upper + shift
    fields = {"lower": lower, "upper": upper, "margin": c["margin"], "leak": c["leak"]}
    made = rebind(template, initial=truth, **fields)
    low, high = made.widened
    return made, low + share * (high - low)
