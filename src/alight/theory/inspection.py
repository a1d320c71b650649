"""Every intermediate signal of the adaptive laws at one state, under the paper's names."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from alight.control import (
    AdaptiveContactLaw,
    AdaptiveState,
    Estimate,
    ForceLimiting,
    Gains,
    Target,
    Unsaturated,
)
from alight.control.transition import Errors
from alight.errors import AlightError
from alight.models import LinearSpring, MassSpring, Plant, PlantState, TwoLinkArm
from alight.scenarios import Scenario, load_scenario
from alight.simulation.continuous import join_state, split_state
from alight.symbolic.derive import jacobian, time_derivative
from alight.symbolic.ops import determinant
from alight.theory.lossless import lossless
from alight.theory.lyapunov import V, V_r, ideal_measurement

INPUTS = ("plant", "ref", "gains", "proj_dk", "state")
STATE = {"q": 2, "q_dot": 2, "x_m": 0, "x_m_dot": 0, "e_f": 0, "theta_dk_hat": 0}
"""Number of entries of each part of the state but ``theta_r_hat``; 0 for a single number."""
PLANT_ENTRIES = {"p": 3, "l": 2, "m": 0, "k_s": 0, "K_I": 0, "x_0": 0}
BOX_ENTRIES = {"lo": 0, "hi": 0, "eps": 0, "delta": 0, "n": 0}


def inspect(
    subject: Scenario | str | Path | Mapping[str, Any] | None = None, /, **given: Any
) -> dict[str, Any]:
    """Return every intermediate signal of (32) and (44) at one state.

    The plant is lossless there, as in (1)-(8): no friction, no damping. ``V_dot`` and ``V_r_dot``
    hold under (32) with (33) before projection.

    Parameters
    ----------
    subject : Scenario, name or path of one, or mapping
        A scenario with an adaptive law; or a mapping with the entries ``plant`` (``p``, ``l``,
        ``m``, ``k_s``, ``K_I``, ``x_0``), ``ref`` (``x_md``, ``x_rd2``), ``gains`` (those of (42)
        and (43)), ``proj_dk`` (``lo``, ``hi``, ``eps``, ``delta``, ``n`` of the projection of
        ``theta_dk_hat``) and ``state``.
    **given
        The same entries as keywords; with a scenario, ``state`` alone: a mapping with any of
        ``q``, ``q_dot``, ``x_m``, ``x_m_dot``, ``e_f``, ``theta_dk_hat``, ``theta_r_hat``, the
        others being those of the scenario's start.

    Returns
    -------
    dict
        Floats, and arrays of shape (2,), (10,), (2, 2) or (2, 10), SI units, by name: ``x_r``,
        ``Mbar``, ``eta_m``, ``x_rd_dot``, ``Y_r``, ``F_eq32``, ``tau_eq32``, ``V_r_dot``, ...

    Raises
    ------
    AlightError
        If an entry is missing or unknown, or a value is refused.
    """
    if subject is None or isinstance(subject, Mapping):
        plant, law, s, a = _from_mapping({**(subject or {}), **given})
    else:
        _same_names("inspect of a scenario", {"state": {}, **given}, ["state"])
        plant, law, s, a = _from_scenario(subject, **given)
    e = law.errors(ideal_measurement(s), a.u_f, a.theta_dk_hat)
    return {
        **_arm(plant, s, e),
        **_mass_and_filter(plant, law, s, a, e),
        **_tip_and_force(plant, law, s, a, e),
    }


def _arm(plant: Plant, s: PlantState, e: Errors) -> dict[str, Any]:
    arm, touch = plant.arm, plant.touch(s)
    J = arm.J(s.q)
    return {
        "x_r": e.x_r,
        "x_r_dot": e.x_r_dot,
        "J": J,
        "J_dot": arm.J_dot(s.q, s.q_dot),
        "det_J": determinant(J),
        "M": arm.M(s.q),
        "C": arm.C(s.q, s.q_dot),
        "Mbar": arm.M_bar(s.q),
        "Cbar": arm.C_bar(s.q, s.q_dot),
        "Lambda": float(touch.Lambda),
        "delta": float(touch.Lambda * touch.gap),
        "F_m": float(touch.F_m),
    }


def _mass_and_filter(
    plant: Plant, law: AdaptiveContactLaw, s: PlantState, a: AdaptiveState, e: Errors
) -> dict[str, Any]:
    g, body, F_m = law.gains, plant.body, plant.touch(s).F_m
    Y_d = body.Y_d(s.x_m)
    x_m_ddot = body.acceleration(s.x_m, s.x_m_dot, F_m)
    mu, theta = law.mu_dk(s.x_m, e.eta_m), a.theta_dk_hat
    slope_mu = jacobian(lambda v: law.theta_dk.project(v, theta), mu)
    slope_theta = jacobian(lambda v: law.theta_dk.project(mu, v), theta)

    def eta_m(x_m: Any, x_m_dot: Any, u_f: Any) -> Any:
        return law.filter_rates(x_m, x_m_dot, u_f, theta)[0]

    eta_m_dot = time_derivative(eta_m, [s.x_m, s.x_m_dot, a.u_f], [s.x_m_dot, x_m_ddot, e.u_f_dot])
    x_rd1_ddot = law.x_rd1_ddot(s.x_m, s.x_m_dot, a.u_f, theta, x_m_ddot)
    without_E2 = x_rd1_ddot - Y_d * slope_theta * e.theta_dk_hat_dot
    return {
        "e_m": e.e_m,
        "e_m_dot": -s.x_m_dot,
        "eta_m": e.eta_m,
        "e_f_dot": e.u_f_dot / (1 - a.u_f**2),
        "Y_d": Y_d,
        "x_m_ddot": x_m_ddot,
        "eta_m_dot": eta_m_dot,
        # what (21) leaves over when everything else in it is known
        "chi": body.m * (eta_m_dot + g.alpha2 * g.k1 * e.eta_m) - body.k_s * Y_d + F_m,
        "mu_dk": mu,
        "proj_dk": e.theta_dk_hat_dot,
        "dproj_dk_dmu": slope_mu,
        "dproj_dk_dtheta": slope_theta,
        "theta_dk_true": plant.theta_dk,
        "theta_dk_hat_dot": e.theta_dk_hat_dot,
        "x_rd": e.x_rd,
        "x_rd_dot": e.x_rd_dot,
        "x_rd_dot_AD": e.x_rd_dot,
        "x_rd_ddot_eq46_printed": np.array([without_E2, 0.0]),
        "x_rd_ddot_eq46_corrected": np.array([x_rd1_ddot, 0.0]),
        "x_rd_ddot_AD": np.array([x_rd1_ddot, 0.0]),
    }


def _tip_and_force(
    plant: Plant, law: AdaptiveContactLaw, s: PlantState, a: AdaptiveState, e: Errors
) -> dict[str, Any]:
    measured = ideal_measurement(s)
    pi, J = law.pi_of(plant), plant.arm.J(s.q)
    Y_r = law.Y_r(measured, e)
    feedforward = Y_r @ a.theta_r_hat
    saturated = feedforward + ForceLimiting.feedback(law, e.e_r, e.r_r)  # type: ignore[arg-type]
    unsaturated = feedforward + Unsaturated.feedback(law, e.e_r, e.r_r)  # type: ignore[arg-type]
    unprojected = law.mu_r(Y_r, e.r_r)
    moving = plant.rates(s, J.T @ saturated)
    rates = AdaptiveState(e.u_f_dot, e.theta_dk_hat_dot, unprojected)

    def along(function: Any) -> Any:
        at, speed = join_state(law, s, a._asdict()), join_state(law, moving, rates._asdict())

        def of_column(column: Any) -> Any:
            plant_state, memory = split_state(law, column)
            return function(plant_state, AdaptiveState(**memory))

        return time_derivative(of_column, [at], [speed])

    return {
        "e_r": e.e_r,
        "e_r_dot": e.e_r_dot,
        "r_r": e.r_r,
        "theta_r_true": law.theta_r_of(pi),
        "Y_r": Y_r,
        "W_eq31": law.W(pi, measured, e),
        "F_eq32": saturated,
        "tau_eq32": J.T @ saturated,
        "F_eq44": unsaturated,
        "tau_eq44": J.T @ unsaturated,
        "theta_r_hat_dot_noproj": unprojected,
        "q_ddot": moving.q_dot,
        "x_r_ddot": along(lambda s, a: plant.arm.J(s.q) @ s.q_dot),
        "r_r_dot": along(lambda s, a: law.errors(ideal_measurement(s), a.u_f, a.theta_dk_hat).r_r),
        "V": V(plant, law, s, a),
        "V_r": V_r(plant, law, s, a),
        "V_dot": along(lambda s, a: V(plant, law, s, a)),
        "V_r_dot": along(lambda s, a: V_r(plant, law, s, a)),
    }


def _from_scenario(
    subject: Scenario | str | Path, state: Mapping[str, Any] | None = None
) -> tuple[Plant, AdaptiveContactLaw, PlantState, AdaptiveState]:
    scenario = subject if isinstance(subject, Scenario) else load_scenario(subject)
    law = scenario.law
    if not isinstance(law, AdaptiveContactLaw):
        raise AlightError(f"{type(law).__name__} is not an adaptive law; inspect needs one")
    start = scenario.start
    # V and its rate are those of (32) whatever the scenario's law
    law = ForceLimiting(**{f.name: getattr(law, f.name) for f in dataclasses.fields(ForceLimiting)})
    defaults = {
        "q": start.q,
        "q_dot": start.q_dot,
        "x_m": start.x_m,
        "x_m_dot": start.x_m_dot,
        "e_f": law.e_f,
        "theta_dk_hat": law.theta_dk.initial,
        "theta_r_hat": law.theta_r.initial,
    }
    return (lossless(scenario.plant), law, *_states(law, {**defaults, **dict(state or {})}))


def _same_names(where: str, given: Any, needed: Iterable[str]) -> None:
    if not isinstance(given, Mapping):
        raise AlightError(f"{where} = {given!r}: must be a mapping with {sorted(needed)}")
    if set(given) != set(needed):
        raise AlightError(f"{where} has the entries {sorted(given)}; needs {sorted(needed)}")


def _numbers(where: str, given: Any, sizes: Mapping[str, int]) -> dict[str, Any]:
    """Entries as floats and arrays, refused unless they are finite and of the stated sizes."""
    _same_names(where, given, sizes)
    found: dict[str, Any] = {}
    for name, size in sizes.items():
        try:
            value = np.asarray(given[name], dtype=float)
        except (TypeError, ValueError):
            value = np.array(np.nan)
        if value.shape != ((size,) if size else ()) or not np.isfinite(value).all():
            wanted = f"{size} finite numbers" if size else "a finite number"
            raise AlightError(f"{where}.{name} = {given[name]!r}: must be {wanted}")
        found[name] = value if size else float(value)
    return found


def _states(law: AdaptiveContactLaw, state: Any) -> tuple[PlantState, AdaptiveState]:
    v = _numbers("state", state, {**STATE, "theta_r_hat": len(law.Gamma_r)})
    s = PlantState(v["q"], v["q_dot"], v["x_m"], v["x_m_dot"], 0.0)
    return s, AdaptiveState(float(np.tanh(v["e_f"])), v["theta_dk_hat"], v["theta_r_hat"])


def _from_mapping(
    inputs: Mapping[str, Any],
) -> tuple[Plant, AdaptiveContactLaw, PlantState, AdaptiveState]:
    _same_names("inspect", inputs, INPUTS)
    _same_names("ref", inputs["ref"], [f.name for f in dataclasses.fields(Target)])
    _same_names("gains", inputs["gains"], [*(f.name for f in dataclasses.fields(Gains)), "Gamma_r"])
    p = _numbers("plant", inputs["plant"], PLANT_ENTRIES)
    box = _numbers("proj_dk", inputs["proj_dk"], BOX_ENTRIES)
    if box["lo"] >= box["hi"]:
        raise AlightError(f"proj_dk.lo = {box['lo']}: must lie below proj_dk.hi = {box['hi']}")
    plant = Plant(
        TwoLinkArm(*p["l"], *p["p"]),
        MassSpring(p["m"], p["k_s"], p["x_0"]),
        LinearSpring(K_I=p["K_I"]),
    )
    half = (box["hi"] - box["lo"]) / 2
    gains = dict(inputs["gains"])
    Gamma_r = tuple(gains.pop("Gamma_r"))
    law = ForceLimiting(
        model=plant,
        target=Target(**inputs["ref"]),
        Gamma_r=Gamma_r,
        gains=Gains(**gains),
        theta_dk=Estimate(
            (box["hi"] + box["lo"]) / 2,
            box["lo"],
            box["hi"],
            margin=box["eps"] / half,
            leak=box["delta"] / half**2,
            order=inputs["proj_dk"]["n"],
        ),
        # (33) is wanted before projection: bounds that never act
        theta_r=Estimate((0.0,) * len(Gamma_r), (-1.0,) * len(Gamma_r), (1.0,) * len(Gamma_r)),
    )
    return (plant, law, *_states(law, inputs["state"]))
