"""The plane of ``alpha1`` and ``k1``: where LOC and VTX hold."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from alight.control import Gains
from alight.symbolic.parameters import rebind
from alight.theory.case import Case
from alight.theory.proven import loc_adapting_margin, loc_margin, vtx_margin

POINTS = 241
DECADES = 1.5
"""How far the plane reaches beyond the gains that it must show."""


@dataclass(frozen=True)
class Region:
    """Margins of conditions over the plane; the other gains are those of a given set."""

    alpha1: np.ndarray
    """Abscissa [1/s], shape (n,)."""
    k1: np.ndarray
    """Ordinate, shape (n,)."""
    LOC: np.ndarray
    """Margin of LOC [1/s], shape (n, n), a row for each ``k1``."""
    LOC_adapting: np.ndarray
    """Margin of LOC with adaptation at the worst ``K_I / m`` [1/s]."""
    VTX: np.ndarray
    """Margin of VTX at the worst of the assumptions [1/s]."""
    VTX_moved: np.ndarray
    """The same with the other gains of the second set."""


def region(case: Case, moved: Gains) -> Region:
    """Evaluate the conditions around the gains of a case and a second set of them."""
    b, gains = case.bounds, case.law.gains
    alpha1, k1 = (_axis([getattr(g, name) for g in (gains, moved)]) for name in ("alpha1", "k1"))
    spread = {"alpha1": alpha1[None, :], "k1": k1[:, None]}
    plane = rebind(gains, **spread)
    return Region(
        alpha1,
        k1,
        loc_margin(plane),  # type: ignore[arg-type]
        loc_adapting_margin(plane, b.zeta_K[0] / b.m_u, case.compression),  # type: ignore[arg-type]
        vtx_margin(plane, b.m_u, b.zeta_K[0]),
        vtx_margin(rebind(moved, **spread), b.m_u, b.zeta_K[0]),
    )


def _axis(values: list[float]) -> np.ndarray:
    low, high = np.log10(min(values)) - DECADES, np.log10(max(values)) + DECADES
    return np.logspace(low, high, POINTS)
