"""Local stability of the lossless closed loop in contact: condition LOC and the linearisation."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from alight.control.adaptive import AdaptiveContactLaw, AdaptiveState
from alight.control.gains import Gains
from alight.models import Plant, PlantState
from alight.models.arm import Elbow
from alight.simulation.continuous import continuous_rates, join_state
from alight.symbolic.build import build


def loc_margin(gains: Gains) -> float:
    """Margin of condition LOC [1/s]: ``alpha2 (k1 + 1/k1) + alpha3 - alpha1``.

    Perfect tracking in permanent contact leaves the mass and the filter with the characteristic
    polynomial ``s^3 + (k1 alpha2 + alpha3) s^2 + kappa k2 (1 + k1^2) s
    + kappa k2 (alpha3 + k1^2 alpha1)``, ``kappa = K_I / m``. By Routh it is stable if and only if
    this margin is positive, whatever the mass and the stiffness.
    """
    g = gains
    return g.alpha2 * (g.k1 + 1 / g.k1) + g.alpha3 - g.alpha1


def loc_adapting_margin(gains: Gains, kappa: float, compression: float) -> float:
    """Margin of condition LOC with adaptation of ``theta_dk_hat`` [1/s].

    Positive if and only if the mass, its filter and ``theta_dk_hat``, linearised in permanent
    contact under perfect tracking, are asymptotically stable. With ``D`` the compression,
    ``g = Gamma D^2 kappa`` and ``B``, ``C`` the last two coefficients of the cubic of `loc_margin`,
    their characteristic polynomial is

        s^4 + A s^3 + (B + g) s^2 + (C + g (alpha1 + alpha3)) s + g (alpha1 alpha3 + alpha2^2)

    with ``A = k1 alpha2 + alpha3``. All its coefficients are positive, so that Routh asks for
    ``(A (B + g) - C') C' > A^2 g (alpha1 alpha3 + alpha2^2)`` alone, ``C'`` being the fourth one.
    Divided by ``kappa k2 k1^2 C'`` this is ``loc_margin + (h / k1^2) (k1 alpha2 - alpha1 - A^2
    (alpha1 alpha3 + alpha2^2) / (kappa k2 (c + h (alpha1 + alpha3)))) > 0``, where
    ``h = Gamma D^2 / k2`` and ``c = alpha3 + k1^2 alpha1``.

    It grows with ``kappa``: of an interval the lower end is the worst. It tends to `loc_margin` as
    ``Gamma D^2`` tends to zero. Where it is positive so is `loc_margin`: either ``k1 alpha2`` is
    above ``alpha1``, which is enough for LOC, or all that adaptation adds is negative. LOC does not
    imply it: with ``k1 alpha2 < alpha1`` a large ``Gamma`` destabilises at every ``kappa``.

    Parameters
    ----------
    gains : Gains
        Its ``Gamma`` included.
    kappa : float
        ``K_I / m`` [1/s^2].
    compression : float
        ``x_md - x_0`` [m], where the linearisation is taken.
    """
    g = gains
    A = g.k1 * g.alpha2 + g.alpha3
    h = g.Gamma * compression**2 / g.k2
    c = g.alpha3 + g.k1**2 * g.alpha1 + h * (g.alpha1 + g.alpha3)
    lag = A**2 * (g.alpha1 * g.alpha3 + g.alpha2**2) / (kappa * g.k2 * c)
    return loc_margin(g) + h / g.k1**2 * (g.k1 * g.alpha2 - g.alpha1 - lag)


@dataclass(frozen=True)
class LocalStability:
    """Linearisation of the continuous closed loop at its contact equilibrium."""

    state: np.ndarray
    """The equilibrium: plant, then law, in the order of `alight.simulation.continuous`."""
    eigenvalues: np.ndarray
    """Eigenvalues of the linearisation [1/s]."""

    @property
    def growth(self) -> float:
        """Largest real part [1/s]; at or below zero (to rounding) where nothing grows."""
        return float(self.eigenvalues.real.max())


def linearise(plant: Plant, law: AdaptiveContactLaw, elbow: Elbow) -> LocalStability:
    """Linearise the continuous closed loop about set point, contact and true parameters.

    The estimates move along directions that no signal excites; these give eigenvalues at zero.
    The bristle of the tip friction is held: friction must be off in ``plant``.
    """
    target, body, K_I = law.target, plant.body, plant.contact.K_I
    held = body.k_s * body.Y_d(target.x_md)
    tip = (target.x_md + held / K_I, target.x_rd2)
    s = PlantState(plant.arm.inverse(np.array(tip), elbow), np.zeros(2), target.x_md, 0.0, 0.0)
    true = AdaptiveState(0.0, plant.theta_dk, law.theta_r_of(law.pi_of(plant)))
    at = join_state(law, s, true._asdict())
    column = ca.SX.sym("x", at.size)
    moving, _ = continuous_rates(plant, law, column)
    slope = build("slope", {"x": column}, {"A": ca.jacobian(moving, column), "x_dot": moving})
    matrix, _ = (np.asarray(v) for v in slope(at))
    return LocalStability(at, np.linalg.eigvals(matrix))
