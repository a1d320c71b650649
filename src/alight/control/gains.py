"""What an engineer sets: gains and target."""

from __future__ import annotations

from typing import Annotated

from alight.symbolic.parameters import Positive, PositivePair, Quantity, parameters


@parameters
class Gains:
    """Control gains, in the paper's symbols; ``k3`` and ``alpha`` are diagonal, as in (42)."""

    k1: Annotated[Positive, Quantity("", "nonlinear damping of the filter, (18) and (25)")]
    k2: Annotated[Positive, Quantity("m", "reach of the desired trajectory, (25)")]
    k3: Annotated[PositivePair, Quantity("N", "feedback of the filtered tracking error, (32)")]
    alpha1: Annotated[Positive, Quantity("1/s", "mass error in the filtered error, (17)")]
    alpha2: Annotated[Positive, Quantity("1/s", "filter state in the filtered error, (17)")]
    alpha3: Annotated[Positive, Quantity("1/s", "decay of the filter, (18)")]
    alpha: Annotated[PositivePair, Quantity("1/s", "position error in r_r, (17)")]
    Gamma: Annotated[Positive, Quantity("1/m^2", "adaptation gain of theta_dk_hat, (27)")]


@parameters
class Target:
    """Where the mass and the tip shall come to rest."""

    x_md: Annotated[float, Quantity("m", "desired position of the mass, (16)")]
    x_rd2: Annotated[float, Quantity("m", "desired position of the tip along X2, (25)")]
