"""What the work of the motors allows the contact force to become."""

from __future__ import annotations

import numpy as np

from alight.models import Plant
from alight.models.arm import Arm
from alight.models.contact import ContactLaw
from alight.simulation import Recording
from alight.theory.newtons.integral import integral
from alight.theory.newtons.observe import sampled


def elastic_force(contact: ContactLaw, energy: np.ndarray) -> np.ndarray:
    """Largest elastic force [N] while the contact stores at most ``energy`` [J].

    ``sqrt(2 K_I energy)`` for (7). The energy of every contact law is a power of the penetration,
    which the ratio of two of its values tells.
    """
    unit = float(contact.energy(1.0))
    exponent = np.log2(float(contact.energy(2.0)) / unit)
    penetration = (np.maximum(energy, 0.0) / unit) ** (1 / exponent)
    return np.asarray(contact.pressing(penetration, 0.0))


def supplied(recording: Recording) -> np.ndarray:
    """Work [J] of the motors since the first sample.

    Exact for a sampled loop: its torque is held from one sample to the next, so that it works by
    ``tau . (q_next - q)``. For the continuous loop it is Simpson's rule.

    The recording must hold every sample, as `alight.theory.newtons.bounds_in_newtons` checks.
    """
    tau = recording["tau_applied"]
    if sampled(recording):
        steps = np.sum(tau[:-1] * np.diff(recording["q"], axis=0), axis=1)
        return np.concatenate([[0.0], np.cumsum(steps)])
    power = np.sum(tau * recording["q_dot"], axis=1)
    return integral(power, recording.t)


NODES, WEIGHTS = np.polynomial.legendre.leggauss(24)


def gravity_potential(arm: Arm, q: np.ndarray) -> np.ndarray:
    """Potential energy [J] of gravity at poses ``q``, shape (n, 2), relative to the first of them.

    The work against ``h`` along straight lines from there: to rounding, ``h`` being made of sines
    of the angles.
    """
    if not arm.gravitational:
        return np.zeros(len(q))
    way = q - q[0]
    rises = np.zeros(len(q))
    for node, weight in zip((NODES + 1) / 2, WEIGHTS / 2, strict=True):
        h = np.asarray(arm.h((q[0] + node * way).T))
        rises += weight * np.sum(h * way.T, axis=0)
    return rises


def available(plant: Plant, recording: Recording, stored: np.ndarray) -> np.ndarray:
    """Energy [J] that the contact can hold at most at each sample, ``E(0) + work``.

    ``stored`` is `alight.models.Plant.energy` at each sample. Friction and damping only take from
    it, as does gravity where the arm has risen.
    """
    return stored[0] + supplied(recording) - gravity_potential(plant.arm, recording["q"])
