"""What a designer claims to know of a plant: Assumptions 1 and 2, and Remark 1."""

from __future__ import annotations

from typing import Annotated

from alight.symbolic.parameters import Pair, Positive, PositivePair, Quantity, parameters


@parameters
class Assumptions:
    """Bounds that the conditions of Theorem 1 are evaluated from; no law reads them.

    Those of the estimated parameters are the projection boxes of the law.
    """

    m_l: Annotated[Positive, Quantity("kg", "lower bound of the mass, Assumption 2")]
    m_u: Annotated[Positive, Quantity("kg", "upper bound of the mass, Assumption 2")]
    zeta_K: Annotated[
        PositivePair, Quantity("N/m", "lower and upper bound of the contact stiffness, (11)")
    ]
    zeta_ks: Annotated[
        PositivePair, Quantity("N/m", "lower and upper bound of the spring's stiffness, (11)")
    ]
    zeta_xr: Annotated[float, Quantity("m", "lower bound of the tip along X1, (4)")]
    zeta_xm: Annotated[Positive, Quantity("m", "upper bound of the position of the mass, (4)")]
    sigma_J: Annotated[
        Positive, Quantity("m", "lower bound of the singular values of J, delta of Remark 1")
    ]
    a1: Annotated[
        Positive | None,
        Quantity("kg", "lower bound of M_bar, (9); that of the box of theta_r if absent"),
    ] = None

    def __post_init__(self) -> None:
        pairs: dict[str, Pair] = {
            "m_l and m_u": (self.m_l, self.m_u),
            "zeta_K": self.zeta_K,
            "zeta_ks": self.zeta_ks,
            "zeta_xr and zeta_xm": (self.zeta_xr, self.zeta_xm),
        }
        for name, (lower, upper) in pairs.items():
            if lower >= upper:
                raise ValueError(f"{name} = {lower:g}, {upper:g}: the first must be the smaller")
