"""What the paper does not print, the ranges in which it is sought, and the scenario it gives."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from alight.control import AdaptiveContactLaw
from alight.errors import AlightError
from alight.models import KelvinVoigt, MassSpring, Plant, TwoLinkArm
from alight.models.arm import Elbow
from alight.scenarios import Scenario, load_scenario


@dataclass(frozen=True)
class Unknown:
    """A number that is sought, and the range that physics leaves it."""

    low: float
    high: float
    reason: str
    logarithmic: bool = True


UNKNOWNS: dict[str, Unknown] = {
    "l1": Unknown(0.22, 0.45, "link 1 [m]; the tip reaches 0.44 m at (40)", False),
    "l2": Unknown(0.12, 0.45, "link 2 [m]", False),
    "p1": Unknown(0.3, 8.0, "inertia about the base [kg m^2] that a 240 N m motor drives"),
    "p2_share": Unknown(0.01, 0.5, "p2 over p1"),
    "p3_share": Unknown(0.05, 0.95, "p3 over sqrt((p1 - p2) p2), below 1 for M > 0", False),
    "m": Unknown(1.0, 12.0, "undercarriage, plate and probe [kg]"),
    "K_I/m": Unknown(4e4, 2e5, "(43) suggests about 1e5 [1/s^2]"),
    "k_s/m": Unknown(200.0, 700.0, "(43) suggests about 350 [1/s^2]"),
    "contact_damping": Unknown(0.02, 1.0, "damping ratio of mass and stiff spring"),
    "body_damping": Unknown(0.1, 60.0, "air bearings and transducer [N s/m]"),
    "viscous1": Unknown(0.1, 12.0, "direct-drive base motor [N m s]"),
    "viscous2": Unknown(0.02, 5.0, "direct-drive elbow motor [N m s]"),
    "mu": Unknown(0.2, 0.9, "dry friction between tip and aluminium plate", False),
    "deflection": Unknown(5e-5, 4e-4, "tangential give of tip and plate [m]"),
    "breakaway": Unknown(0.5, 0.95, "elastic share of that give", False),
    "resolution": Unknown(1e-6, 5e-6, "transducer [m]; 2.56 and 5 um look like its steps", False),
    "noise": Unknown(1e-8, 1e-6, "transducer [m]"),
    "p_start": Unknown(0.02, 1.5, "start of the inertia estimates over their true value", False),
    "pK_start": Unknown(0.02, 1.5, "start of the p K_I / m estimates, likewise", False),
    "pk_start": Unknown(0.02, 1.5, "start of the p k_s / m estimates, likewise", False),
    "K_start": Unknown(0.02, 1.5, "start of the K_I estimate, likewise", False),
    "upper": Unknown(1.02, 6.0, "upper bounds over the true value, p1 block of theta_r", False),
    "lower": Unknown(0.0, 0.9, "lower bounds, likewise", False),
    "upper_23": Unknown(1.005, 2.0, "upper bounds, p2 and p3 blocks of theta_r", False),
    "lower_23": Unknown(0.0, 0.995, "lower bounds, likewise", False),
    "upper_K": Unknown(1.005, 2.0, "upper bound of the K_I estimate", False),
    "lower_K": Unknown(0.0, 0.995, "lower bound, likewise", False),
    "dk_start": Unknown(0.2, 9.0, "start of theta_dk_hat over theta_dk, Experiment 1", False),
    "dk_start_2": Unknown(0.2, 9.0, "the same in Experiment 2, which has its own tuning", False),
    "dk_upper": Unknown(1.5, 10.0, "upper bound of theta_dk over its true value", False),
    "dk_lower": Unknown(0.0, 0.9, "lower bound, likewise", False),
    "limit1": Unknown(8.0, 230.0, "artificial limit of the base motor in Experiment 2 [N m]"),
    "limit2": Unknown(2.0, 20.0, "artificial limit of the elbow motor [N m]"),
    "clearance": Unknown(5e-4, 2.5e-3, "capacitance probe [m]", False),
}
NAMES = tuple(UNKNOWNS)
_LOW, _HIGH = (np.array([getattr(u, end) for u in UNKNOWNS.values()]) for end in ("low", "high"))
_LOG = np.array([u.logarithmic for u in UNKNOWNS.values()])
_INSIDE = 1e-6
"""Share of an interval that keeps a start clear of its bounds."""


def values_at(point: np.ndarray) -> dict[str, float]:
    """Values of the unknowns at a point of the unit cube."""
    u = np.clip(point, 0.0, 1.0)
    base = np.where(_LOG, _LOW, 1.0)
    geometric = base * np.where(_LOG, _HIGH / base, 1.0) ** u
    return dict(
        zip(NAMES, np.where(_LOG, geometric, _LOW + u * (_HIGH - _LOW)).tolist(), strict=True)
    )


def point_of(values: Mapping[str, float]) -> np.ndarray:
    """Point of the unit cube at which the unknowns have the given values.

    Raises
    ------
    AlightError
        If an unknown is missing, superfluous or out of its range.
    """
    if set(values) != set(NAMES):
        raise AlightError(f"unknowns {sorted(values)} given; needs {sorted(NAMES)}")
    point = []
    for name, unknown in UNKNOWNS.items():
        low, high, value = unknown.low, unknown.high, values[name]
        if not low <= value <= high:
            raise AlightError(f"{name} = {value:g} is not between {low:g} and {high:g}")
        if unknown.logarithmic:
            point.append(np.log(value / low) / np.log(high / low))
        else:
            point.append((value - low) / (high - low))
    return np.array(point)


@functools.cache
def _template() -> Scenario:
    return load_scenario("experiment-1")


def plant_of(v: Mapping[str, float]) -> Plant:
    """The plant that the unknowns describe."""
    p1, p2 = v["p1"], v["p2_share"] * v["p1"]
    m, K_I = v["m"], v["K_I/m"] * v["m"]
    return Plant(
        TwoLinkArm(
            v["l1"],
            v["l2"],
            p1,
            p2,
            v["p3_share"] * float(np.sqrt((p1 - p2) * p2)),
            viscous=(v["viscous1"], v["viscous2"]),
        ),
        MassSpring(m, v["k_s/m"] * m, _template().plant.body.x_0, v["body_damping"]),
        KelvinVoigt(K_I=K_I, damping=2 * v["contact_damping"] * float(np.sqrt(K_I * m))),
    )


def settings_of(v: Mapping[str, float], elbow: Elbow) -> tuple[dict[str, Any], dict[str, Any]]:
    """Values by scenario path: those of both experiments, and those of Experiment 2 alone."""
    plant, law = plant_of(v), _template().law
    assert isinstance(law, AdaptiveContactLaw)  # the shipped scenario states it
    theta_r = np.asarray(law.theta_r_of(law.pi_of(plant)))
    lower, upper = (
        theta_r * ([v[end]] * 3 + [v[f"{end}_23"]] * 6 + [v[f"{end}_K"]])
        for end in ("lower", "upper")
    )
    shares = np.array([v["pK_start"], v["pk_start"], v["p_start"]] * 3 + [v["K_start"]])
    room = _INSIDE * (upper - lower)
    start = np.clip(shares * theta_r, lower + room, upper - room)
    theta_dk = plant.theta_dk
    arm, body, contact = plant.arm, plant.body, plant.contact
    assert isinstance(contact, KelvinVoigt)
    both = {
        **{f"plant.arm.{name}": getattr(arm, name) for name in ("l1", "l2", "p1", "p2", "p3")},
        "plant.arm.viscous": list(arm.viscous),
        **{f"plant.body.{name}": getattr(body, name) for name in ("m", "k_s", "damping")},
        **{f"plant.contact.{name}": getattr(contact, name) for name in ("K_I", "damping")},
        **{f"plant.tip_friction.{name}": v[name] for name in ("mu", "deflection", "breakaway")},
        **{f"testbed.transducer.{name}": v[name] for name in ("resolution", "noise")},
        "testbed.probe.clearance": v["clearance"],
        "start.elbow": elbow,
        "law.theta_dk.initial": _theta_dk_start(v, v["dk_start"]) * theta_dk,
        "law.theta_dk.lower": v["dk_lower"] * theta_dk,
        "law.theta_dk.upper": v["dk_upper"] * theta_dk,
        "law.theta_r.initial": start.tolist(),
        "law.theta_r.lower": lower.tolist(),
        "law.theta_r.upper": upper.tolist(),
    }
    second = {
        "testbed.motors.artificial_limit": [v["limit1"], v["limit2"]],
        "law.theta_dk.initial": _theta_dk_start(v, v["dk_start_2"]) * theta_dk,
    }
    return both, second


def _theta_dk_start(v: Mapping[str, float], share: float) -> float:
    room = _INSIDE * (v["dk_upper"] - v["dk_lower"])
    return min(max(share, v["dk_lower"] + room), v["dk_upper"] - room)
