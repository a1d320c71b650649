"""Every proven bound at each instant of a run: of the continuous loop, or of a recording."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from alight.simulation import Recording
from alight.theory.case import Case
from alight.theory.newtons.approach import approach
from alight.theory.newtons.energy import available, elastic_force
from alight.theory.newtons.feedback import feedback_limit, feedback_within, joint_limit
from alight.theory.newtons.integral import integral
from alight.theory.newtons.observe import observe
from alight.theory.newtons.trace import Trace, below, within
from alight.theory.proven.contact import vtx_margin
from alight.theory.proven.first_contact import first_contact
from alight.theory.proven.robot_part import RobotBounds, robot_bounds


def along(case: Case, recording: Recording, switches: np.ndarray | None = None) -> dict[str, Trace]:
    """Evaluate every proven bound along a run that starts as the case does.

    On the continuous loop of `alight.reference` with the plant of the case and motors that do not
    clip, each bound holds at each instant (up to the error of Simpson's rule in those that hold an
    integral). On a recording of a sampled loop with friction and damping only those hold that are
    the law's own; of the others it shows how far they still do.

    Parameters
    ----------
    case : Case
        Law, bounds and start; its ``plant`` is taken for the truth.
    recording : Recording
        Signals of plant and law, every sample of a sampled loop.
    switches : (k,) array, optional
        Times at which contact began or ended [s], where they are known better than to a sample.

    Returns
    -------
    dict
        Traces by name. Those of contact, of the way to it and of its time are left out where the
        run has no such part, or the proposition does not apply.
    """
    known = np.zeros(0) if switches is None else np.asarray(switches)
    run = _Run(case, recording, observe(case.plant, case.law, recording), robot_bounds(case), known)
    return {
        **_lyapunov(run),
        **_tracking(run),
        **_commanded(run),
        **_force(run),
        **_filter(run),
        **_first_touch(run),
        **_contact(run),
    }


def lyapunov_along(case: Case, recording: Recording) -> dict[str, Trace]:
    """``V``, ``V_r`` and ``V_m`` along a run, and what Proposition A says of the second."""
    seen = observe(case.plant, case.law, recording)
    return _lyapunov(_Run(case, recording, seen, robot_bounds(case), np.zeros(0)))


@dataclass(frozen=True)
class _Run:
    case: Case
    recording: Recording
    seen: dict[str, np.ndarray]
    robot: RobotBounds
    switches: np.ndarray

    @property
    def t(self) -> np.ndarray:
        """Times of the samples since the start of the run [s]."""
        return self.recording.t

    @property
    def first_touch(self) -> float | None:
        """Time of the first touch of a run that starts apart [s], to a sample or better."""
        if self.switches.size:
            return float(self.switches[0])
        touching = self.recording["gap"] >= 0
        return float(self.t[np.argmax(touching)]) if touching.any() else None

    def integral(self, values: np.ndarray) -> np.ndarray:
        """Integral over time since the start, at each sample."""
        return integral(values, self.t)


def _lyapunov(run: _Run) -> dict[str, Trace]:
    t, seen = run.t, run.seen
    owed = seen["V_r"][0] - run.integral(seen["dissipation"])
    return {
        "V": Trace(t, seen["V"], None, None, "J", "(47)"),
        "V_m": Trace(t, seen["V_m"], None, None, "J", "mass part of (47)"),
        "V_r": below(t, seen["V_r"], owed, "J", "Proposition A: V_r(0) less the dissipation"),
        "V_r over the boxes": below(t, seen["V_r"], run.robot.R, "J", "Proposition A: R"),
    }


def _tracking(run: _Run) -> dict[str, Trace]:
    t, seen, robot = run.t, run.seen, run.robot
    e_r = np.minimum(robot.e_r_at(t - t[0]), np.array(robot.e_r)[:, None])
    found = {}
    for i in range(2):
        r, e = seen["r_r"][:, i], seen["e_r"][:, i]
        here = np.sqrt(2 * seen["V_r"][0] * seen["mobility"][:, i])
        found[f"r_r{i + 1}"] = within(t, r, robot.r_r[i], "m/s", "Proposition A over the boxes")
        found[f"r_r{i + 1} in its pose"] = within(
            t, r, here, "m/s", "Proposition A: V_r(0), and M_bar of the pose"
        )
        found[f"e_r{i + 1}"] = within(t, e, e_r[i], "m", "Proposition A: e_r_dot = r_r - alpha e_r")
        r_squared = run.integral(r**2)
        found[f"int r_r{i + 1}^2"] = below(
            t, r_squared, robot.r_r_squared[i], "m^2/s", "Proposition A"
        )
    squared = run.integral(seen["e_r"][:, 0] ** 2)
    found["int e_r1^2"] = below(t, squared, robot.e_r1_squared, "m^2 s", "Proposition A")
    return found


def _commanded(run: _Run) -> dict[str, Trace]:
    law, t, seen = run.case.law, run.t, run.seen
    limit = feedback_limit(law)
    source = "sup of the feedback"
    if limit is None:
        limit = feedback_within(law, np.array(run.robot.e_r), np.array(run.robot.r_r))
        source = "feedback at the bounds of Proposition A"
    torque = joint_limit(seen["J_measured"], limit)
    found = {}
    for i in range(2):
        found[f"feedback{i + 1}"] = within(t, seen["feedback"][:, i], limit[i], "N", source)
        found[f"tau_feedback{i + 1}"] = within(
            t, seen["tau_feedback"][:, i], torque[:, i], "N m", f"{source}, through J"
        )
        found[f"F{i + 1}"] = Trace(
            t,
            seen["F"][:, i],
            seen["F_lower"][:, i],
            seen["F_upper"][:, i],
            "N",
            "widened box of theta_r",
        )
    return found


def _force(run: _Run) -> dict[str, Trace]:
    t, seen, plant = run.t, run.seen, run.case.plant
    force, told = seen["F_m_elastic"], seen["F_m_told"]
    energy = available(plant, run.recording, seen["energy"])
    ceiling = elastic_force(plant.contact, energy)
    return {
        "F_m": Trace(t, force, told, told, "N", "identity in the law's signals"),
        "F_m from energy": below(t, force, ceiling, "N", "E(0) and the work of the motors"),
        "energy": below(t, seen["energy"], energy, "J", "E(0) and the work of the motors"),
    }


def _filter(run: _Run) -> dict[str, Trace]:
    room = run.case.law.gains.alpha2 - np.abs(run.seen["drive"])
    safe = room > 0
    kept = len(safe) if safe.all() else int(np.argmin(safe))
    u_f = run.recording["u_f"][:kept]
    return {"u_f": within(run.t[:kept], u_f, 1.0, "", "|alpha1 tanh(e_m) - x_m_dot| < alpha2")}


def _first_touch(run: _Run) -> dict[str, Trace]:
    """Proposition C, where the run starts apart from a mass at rest."""
    (way, _), latest = approach(run.case), first_contact(run.case).latest
    if way is None or latest is None:
        return {}
    touch, alpha_1 = run.first_touch, run.case.law.gains.alpha[0]
    before = len(run.t) if touch is None else int(np.searchsorted(run.t, touch))
    t, u_f, ahead = run.t[:before], run.recording["u_f"][:before], run.seen["ahead"][:before]
    # of the tip where it touches; before that its gap, which is negative, is added
    speed = run.recording["x_r_dot1"][:before] + alpha_1 * run.recording["gap"][:before]
    ended = np.array([run.t[-1] if touch is None else touch])
    fastest = way.fastest(alpha_1, run.robot.r_r[0])
    return {
        "u_f before contact": _between(t, u_f, way.u_f, ""),
        "ahead": _between(t, ahead, way.ahead, "m"),
        "speed of approach": below(t, speed, fastest, "m/s", "Propositions A and C"),
        "first contact": below(ended, ended - run.t[0], latest, "s", "Proposition C"),
    }


def _between(t: np.ndarray, value: np.ndarray, swept: np.ndarray, unit: str) -> Trace:
    """Stay within what is swept on the way to contact."""
    lower, upper = (np.full(len(t), end) for end in (swept.min(), swept.max()))
    return Trace(t, value, lower, upper, unit, "Proposition C, before contact")


def _contact(run: _Run) -> dict[str, Trace]:
    """Proposition B, afresh in each phase of contact."""
    plant, seen = run.case.plant, run.seen
    m, K_I = plant.body.m, plant.contact.K_I
    margin = vtx_margin(run.case.law.gains, m, K_I)
    parts = phases(run.t, run.recording["gap"] >= 0, run.switches)
    if margin <= 0 or not parts:
        return {}
    bounds = []
    for part in parts:
        pushed = integral(seen["e_r"][part, 0] ** 2, run.t[part])
        bounds.append(seen["V_m"][part][0] + K_I**2 / (4 * m * margin) * pushed)
    numbers = np.concatenate([np.arange(len(run.t))[part] for part in parts])
    value, bound = seen["V_m"][numbers], np.concatenate(bounds)
    return {"V_m in contact": below(run.t[numbers], value, bound, "J", "Proposition B")}


def phases(t: np.ndarray, inside: np.ndarray, switches: np.ndarray) -> list[slice]:
    """Parts of a run whose samples lie inside, without a switch between any two of them."""
    gaps = np.searchsorted(switches, t)
    joined = inside[1:] & inside[:-1] & (gaps[1:] == gaps[:-1])
    starts = np.flatnonzero(inside & np.concatenate([[True], ~joined]))
    ends = np.flatnonzero(inside & np.concatenate([~joined, [True]])) + 1
    return [slice(a, b) for a, b in zip(starts, ends, strict=True)]
