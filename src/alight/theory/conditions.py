"""Sufficient conditions of Theorem 1, as printed."""

from __future__ import annotations


def alpha2_floor(zeta_K_upper: float, alpha: float) -> float:
    """First bound of (38): ``alpha2`` must exceed ``zeta_K_upper^2 / (4 alpha)``.

    ``zeta_K_upper`` [N/m] bounds the contact stiffness from above, ``alpha`` [1/s] is the gain of
    the X1 axis. The condition compares quantities of different units, as the paper prints it.
    """
    return zeta_K_upper**2 / (4 * alpha)
