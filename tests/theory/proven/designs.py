"""Many random designs at once: gains as arrays, and closed loops linearised in one batch."""

from __future__ import annotations

import dataclasses
import functools
from typing import NamedTuple

import casadi as ca
import numpy as np

from alight.control import ForceLimiting, Gains
from alight.models import LinearSpring, MassSpring
from alight.simulation.continuous import continuous_rates
from alight.symbolic.build import build
from alight.symbolic.parameters import lift, rebind, values_of
from tests.control.cases import EXPERIMENT_1, PLANT, TARGET, told, true_theta_r

FREE = ("k1", "k2", "alpha1", "alpha2", "alpha3")
LOW = np.array([0.1, 0.05, 1.0, 1.0, 1e-3])
HIGH = np.array([10.0, 5.0, 100.0, 100.0, 10.0])


def log_uniform(rng: np.random.Generator, low, high, size=None):
    return np.exp(rng.uniform(np.log(low), np.log(high), size))


def random_gains(rng: np.random.Generator, count: int) -> Gains:
    """Gains whose `FREE` entries, and ``Gamma``, are arrays."""
    columns = log_uniform(rng, LOW, HIGH, (count, len(FREE))).T
    Gamma = log_uniform(rng, 1e-2, 1e6, count)
    return rebind(EXPERIMENT_1, **dict(zip(FREE, columns, strict=True)), Gamma=Gamma)


def gains_at(gains: Gains, i: int) -> Gains:
    """One set of an array of them."""
    names = (*FREE, "Gamma")
    return dataclasses.replace(EXPERIMENT_1, **{n: float(getattr(gains, n)[i]) for n in names})


class Loops(NamedTuple):
    """Random loops, with the linearisation of each at its equilibrium in contact."""

    gains: Gains
    """Arrays in its `FREE` entries and ``Gamma``."""
    kappa: np.ndarray
    compression: np.ndarray
    eigenvalues: np.ndarray
    """Of the whole loop, shape (n, 19)."""


@functools.cache
def random_loops(seed: int, count: int, adapting: bool) -> Loops:
    """Plants and gains over decades, exact parameters; ``theta_dk_hat`` at rest or adapting."""
    rng = np.random.default_rng(seed)
    gains = random_gains(rng, count)
    if not adapting:
        gains = rebind(gains, Gamma=np.full(count, 1e-12))
    m, K_I = log_uniform(rng, 0.3, 20.0, count), log_uniform(rng, 5e3, 5e5, count)
    k_s, compression = log_uniform(rng, 100.0, 2e3, count), rng.uniform(0.005, 0.05, count)
    laws, states = [], []
    for i in range(count):
        body = MassSpring(m[i], k_s[i], TARGET.x_md - compression[i])
        plant = dataclasses.replace(PLANT, body=body, contact=LinearSpring(K_I=K_I[i]))
        k3, alpha = log_uniform(rng, 1.0, 300.0, 2), log_uniform(rng, 1.0, 100.0, 2)
        own = dataclasses.replace(gains_at(gains, i), k3=tuple(k3), alpha=tuple(alpha))
        law = told(plant, own)
        laws.append(values_of(law))
        states.append(at_rest(law))
    slope = _slope().map(count)
    found = np.asarray(slope(np.array(laws).T, np.array(states).T))
    matrices = found.reshape(19, count, 19).transpose(1, 0, 2)
    return Loops(gains, K_I / m, compression, np.linalg.eigvals(matrices))


def at_rest(law: ForceLimiting) -> np.ndarray:
    """Rest on target with true parameters, typed."""
    plant = law.model
    held = plant.body.k_s * (TARGET.x_md - plant.body.x_0)
    q = plant.arm.inverse((TARGET.x_md + held / plant.contact.K_I, TARGET.x_rd2), "-")
    theta_dk = plant.body.k_s / plant.contact.K_I
    return np.array([*q, 0, 0, TARGET.x_md, 0, 0, 0, theta_dk, *true_theta_r(plant)])


@functools.cache
def _slope() -> ca.Function:
    lifted, column = lift(told()), ca.SX.sym("x", 19)
    moving, _ = continuous_rates(lifted.obj.model, lifted.obj, column)
    given = {"parameters": lifted.symbols, "x": column}
    return build("slope", given, {"A": ca.jacobian(moving, column)})
