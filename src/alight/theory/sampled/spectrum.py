"""Eigenvalues of the sampled loop, and how slowly it may be sampled."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from alight.theory.sampled.linear import LinearLoop

SHORTEST, LONGEST, TRIED = 1e-6, 0.1, 61
"""Sample times [s] between which a border of stability is looked for, and how many are tried."""


@dataclass(frozen=True)
class Spectrum:
    """Eigenvalues of the map over one sample, about a rest."""

    T: float
    """Sample time [s]."""
    judged: np.ndarray
    """Those that law and sample time decide about."""
    free_mass: np.ndarray
    """In free motion those of the mass, which nothing touches; empty in contact."""
    unexcited: int
    """Number of directions of ``theta_r_hat`` with an eigenvalue of exactly 1, left out."""

    @property
    def radius(self) -> float:
        """Largest magnitude of a judged eigenvalue; the loop decays where it is below 1."""
        return float(np.abs(self.judged).max())

    @property
    def least_damped(self) -> tuple[float, float]:
        """Damping ratio and frequency [rad/s] of the least damped judged mode.

        They are those of ``log(z) / T``, the continuous mode that the samples show; of modes that
        do not oscillate, those of the slowest.
        """
        living = self.judged[self.judged != 0]
        s = np.log(living.astype(complex)) / self.T
        damping = -s.real / np.maximum(np.abs(s), np.finfo(float).tiny)
        least = min(range(len(s)), key=lambda i: (round(damping[i], 12), abs(s[i])))
        return float(damping[least]), float(np.abs(s[least]))


def spectrum(loop: LinearLoop, T: float, delay: bool) -> Spectrum:
    """Eigenvalues of a loop sampled every ``T`` seconds, torque delayed by a sample or not."""
    free = loop.rest.phase == "free motion"
    mass = np.linalg.eigvals(loop.free_mass(T)) if free else np.zeros(0)
    judged = np.linalg.eigvals(loop.judged(T, delay))
    return Spectrum(T, 1 + T * judged, 1 + T * mass, loop.unexcited)


def growth(loop: LinearLoop, T: float, delay: bool) -> float:
    """Largest rate [1/s] at which a judged mode grows, ``log|z| / T``; below zero if all decay."""
    rates = np.linalg.eigvals(loop.judged(T, delay))
    # |1 + T s|^2 - 1, exact where T s is small; -1 for a mode that ends within the sample
    excess = np.maximum(2 * T * rates.real + T**2 * np.abs(rates) ** 2, -1 + 1e-300)
    return float(np.log1p(excess.max()) / (2 * T))


def largest_sample_time(loop: LinearLoop, delay: bool) -> tuple[float | None, str]:
    """End of the first interval of sample times, from 0 on, in which all judged modes decay [s].

    It is looked for on a logarithmic grid from `SHORTEST` to `LONGEST` and refined; an interval of
    instability narrower than the grid, a fifth of the sample time, could be missed.

    Returns
    -------
    T : float or None
    undefined : str
        Why there is no value; empty if there is one.
    """
    from scipy.optimize import brentq  # a third of a second, which an import need not cost

    before = SHORTEST
    for T in np.geomspace(SHORTEST, LONGEST, TRIED):
        found = growth(loop, float(T), delay)
        if found >= 0 and T == SHORTEST:
            return None, f"it grows at {found:.3g} 1/s however fast it is sampled"
        if found >= 0:
            return float(brentq(lambda t: growth(loop, t, delay), before, T, rtol=1e-9)), ""
        before = float(T)
    return None, f"it decays at every sample time tried, up to {LONGEST:g} s"
