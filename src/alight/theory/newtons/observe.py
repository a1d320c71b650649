"""Every quantity that a bound speaks of, at each sample of a run."""

from __future__ import annotations

import functools
from collections.abc import Hashable
from dataclasses import dataclass, field
from typing import Any

import casadi as ca
import numpy as np

from alight.control import AdaptiveContactLaw, AdaptiveState, Measurement
from alight.control.error_system import eta_m
from alight.models import Plant, PlantState
from alight.simulation import Recording
from alight.simulation.closed_loop import MEASURED, PLANT
from alight.symbolic.build import build
from alight.symbolic.ops import inverse, vector
from alight.symbolic.parameters import lift, structure_of, values_of
from alight.symbolic.signals import Layout
from alight.theory.lyapunov import V, V_m, V_r, dissipation, errors_at
from alight.theory.newtons.force_interval import force_interval


def observe(plant: Plant, law: AdaptiveContactLaw, recording: Recording) -> dict[str, np.ndarray]:
    """Evaluate at each sample, with ``plant`` as the truth: (n,) or (n, size) arrays by name.

    What the law computes is evaluated at what it measured, where the recording says so, and at the
    true state in a recording of the continuous loop. Everything else is that of the true state.
    """
    structure = _Structure((structure_of(plant), structure_of(law)), plant, law)
    function, shapes = _function(structure)
    samples = len(recording)
    seen = [f"{n}_measured" if sampled(recording) else n for n in MEASURED.signals]
    columns = [
        np.tile(np.concatenate([values_of(plant), values_of(law)])[:, None], samples),
        *(_stacked(recording, names) for names in (PLANT.signals, seen, law.states)),
    ]
    found = np.asarray(function.map(samples)(*columns))
    ends = np.cumsum([rows * columns for rows, columns in shapes.values()])
    parts = np.split(found.T, ends[:-1], axis=1)
    return {
        name: _shaped(part, shape)
        for (name, shape), part in zip(shapes.items(), parts, strict=True)
    }


def _shaped(part: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """Undo the column by column of CasADi, sample by sample."""
    rows, columns = shape
    if columns > 1:
        return part.reshape(-1, columns, rows).swapaxes(1, 2)
    return part if rows > 1 else part[:, 0]


def sampled(recording: Recording) -> bool:
    """Whether a recording is that of a sampled loop, with a torque held between its samples."""
    return "q_measured" in recording


def _stacked(recording: Recording, names: Any) -> np.ndarray:
    return np.hstack([recording[name].reshape(len(recording), -1) for name in names]).T


@dataclass(frozen=True)
class _Structure:
    """Plants and laws that differ in numbers alone are equal."""

    key: Hashable
    plant: Plant = field(compare=False)
    law: AdaptiveContactLaw = field(compare=False)


@functools.lru_cache(maxsize=16)
def _function(structure: _Structure) -> tuple[ca.Function, dict[str, tuple[int, int]]]:
    plant, law = lift(structure.plant), lift(structure.law)
    states = Layout(structure.law.states)
    x, y, memory = (ca.SX.sym(n, v.size) for n, v in (("x", PLANT), ("y", MEASURED), ("a", states)))
    s, a = PlantState(**PLANT.unpack(x)), AdaptiveState(**states.unpack(memory))
    measured = Measurement(**MEASURED.unpack(y))
    values = {
        **_stored(plant.obj, law.obj, s, a),
        **_errors(plant.obj, law.obj, s, a),
        **_commanded(law.obj, measured, a),
        **_contact(plant.obj, law.obj, s, measured, a),
    }
    inputs = {"p": ca.vertcat(plant.symbols, law.symbols), "x": x, "y": y, "a": memory}
    expressions = {name: ca.SX(value) for name, value in values.items()}
    everything = ca.vertcat(*(ca.vec(v) for v in expressions.values()))
    shapes = {name: v.shape for name, v in expressions.items()}
    return build("observe", inputs, {"all": everything}), shapes


def _stored(
    plant: Plant, law: AdaptiveContactLaw, s: PlantState, a: AdaptiveState
) -> dict[str, Any]:
    """Lyapunov functions, and mechanical energy [J]."""
    return {
        "V": V(plant, law, s, a),
        "V_r": V_r(plant, law, s, a),
        "V_m": V_m(plant, law, s, a),
        "dissipation": dissipation(law, errors_at(law, s, a)),
        "energy": plant.energy(s),
    }


def _errors(
    plant: Plant, law: AdaptiveContactLaw, s: PlantState, a: AdaptiveState
) -> dict[str, Any]:
    """Errors of tip and filter, and what stands in their bounds."""
    e, arm = errors_at(law, s, a), plant.arm
    J = arm.J(s.q)
    mobility = J @ inverse(arm.M(s.q)) @ J.T
    return {
        "e_r": e.e_r,
        "r_r": e.r_r,
        "mobility": vector(mobility[0, 0], mobility[1, 1]),
        "ahead": e.x_rd[0] - s.x_m,
        "drive": eta_m(law.gains, e.e_m, s.x_m_dot, 0.0),
        "J": J,
    }


def _commanded(law: AdaptiveContactLaw, measured: Measurement, a: AdaptiveState) -> dict[str, Any]:
    """What the law computes from what it measures."""
    flow = law.flow(a._asdict(), measured)
    feedback = flow.signals["F"] - flow.signals["F_feedforward"]
    J = law.model.arm.J(measured.q)
    lower, upper = force_interval(law, measured, a)
    return {
        "F": flow.signals["F"],
        "tau": flow.tau,
        "feedback": feedback,
        "tau_feedback": J.T @ feedback,
        "J_measured": J,
        "F_lower": lower,
        "F_upper": upper,
    }


def _contact(
    plant: Plant, law: AdaptiveContactLaw, s: PlantState, measured: Measurement, a: AdaptiveState
) -> dict[str, Any]:
    """Contact force, its elastic part, and what the law's own signals say of it."""
    touch = plant.touch(s)
    e = law.errors(measured, a.u_f, a.theta_dk_hat)
    told = e.x_rd[0] - measured.x_m - e.e_r[0]
    return {
        "F_m": touch.F_m,
        "F_m_elastic": plant.contact.force(touch.gap, 0.0),
        "gap_told": told,
        "F_m_told": plant.contact.force(told, 0.0),
        "pressing": touch.presses,
    }
