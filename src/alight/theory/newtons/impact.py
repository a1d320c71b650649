"""The first touch, and the tracking errors on the way to it and after."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from alight.theory.newtons.approach import approach
from alight.theory.newtons.bound import Bound
from alight.theory.newtons.commanded import ON_MODEL
from alight.theory.newtons.shown import Shown, peak


def tracking(run: Shown) -> Iterator[Bound]:
    """Proposition A in numbers: ``r_r`` and ``e_r``."""
    arm, robot = run.case.law.model.arm, run.robot
    across = 2 * (arm.l1 + arm.l2)
    for i in range(2):
        yield Bound(
            name=f"filtered tracking error, axis X{i + 1}",
            statement=f"|r_r{i + 1}| <= sqrt(2 R max (M_bar^-1)_ii)",
            unit="m/s",
            proven=ON_MODEL,
            meaning=f"Proposition A over the boxes of theta_r, V_r <= R = {robot.R:.3g} J.",
            value=float(robot.r_r[i]),
            simulated=peak(run.seen["r_r"][:, i]),
        )
    for i in range(2):
        yield Bound(
            name=f"tracking error, axis X{i + 1}",
            statement=f"|e_r{i + 1}| <= sup over e_r_dot = r_r - alpha e_r",
            unit="m",
            proven=ON_MODEL,
            meaning="Proposition A: from the bound of r_r, from that of int r_r^2, or from the "
            "potential, whichever is least.",
            value=float(robot.e_r[i]),
            simulated=peak(run.seen["e_r"][:, i]),
            known=across,
            because="the workspace's diameter",
        )


def impact(run: Shown) -> Iterator[Bound]:
    """Speed at the first touch, and what is made of it without proof."""
    case, seen = run.case, run.seen
    way, undefined = approach(case)
    fastest = None if way is None else way.fastest(case.law.gains.alpha[0], run.robot.r_r[0])
    shown = _first_speed(run)
    touching = run.contact
    force = peak(seen["F_m_elastic"][touching]) if touching.size else None
    yield Bound(
        name="speed of the tip at the first touch",
        statement="x_r1_dot = x_rd1_dot + alpha_1 (x_rd1 - x_m) - r_r1",
        unit="m/s",
        proven=ON_MODEL,
        meaning="From the explicit trajectory before contact, the mass at rest, and Proposition "
        "A's bound of r_r1.",
        value=fastest,
        undefined=undefined,
        simulated=shown,
    )
    b, plant = case.bounds, case.plant
    yield Bound(
        name="peak force of the first impact, from that bound",
        statement="F_m ~ v sqrt(K_I m)",
        unit="N",
        proven="heuristic",
        meaning="A mass struck by a source of constant speed v; m and K_I at their upper bounds. "
        "Beside it the peak of the elastic part up to the first separation.",
        value=None if fastest is None else _blow(fastest, b.zeta_K[1], b.m_u),
        undefined=undefined,
        simulated=force,
    )
    yield Bound(
        name="peak force of the first impact, from the speed in the run",
        statement="F_m ~ v sqrt(K_I m)",
        unit="N",
        proven="heuristic",
        meaning="The same with the speed that the run shows, and the true m and K_I: how good "
        "the rule itself is.",
        value=None if shown is None else _blow(shown, plant.contact.K_I, plant.body.m),
        undefined="" if shown is not None else "the run shows no first touch",
        simulated=force,
    )


def _blow(speed: float, K_I: float, m: float) -> float:
    """Peak force [N] of a mass on a spring that is struck at a constant speed [m/s]."""
    return speed * float(np.sqrt(K_I * m))


def _first_speed(run: Shown) -> float | None:
    """Speed [m/s] of the tip at the last sample before the first touch; None without one."""
    touching = run.contact
    if not touching.size or not touching[0]:
        return None
    return float(run.recording["x_r_dot1"][touching[0] - 1])
