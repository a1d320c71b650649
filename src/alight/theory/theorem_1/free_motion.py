"""(38), (39) and (59)-(62): what keeps ``V`` falling without contact, in spite of ``eps_x``."""

from __future__ import annotations

import numpy as np

from alight.theory.condition import Condition, Constant
from alight.theory.theorem_1.decay import Decay, V_inside, V_u, needed
from alight.theory.theorem_1.design import Design
from alight.theory.theorem_1.formulas import Formulas


def alpha2_floor(zeta_K_upper: float, alpha: float) -> float:
    """First bound of (38): ``alpha2`` must exceed ``zeta_K_upper^2 / (4 alpha)``.

    ``zeta_K_upper`` [N/m] bounds the contact stiffness from above, ``alpha`` [1/s] is the gain of
    the X1 axis. The condition compares quantities of different units, as the paper prints it.
    """
    return zeta_K_upper**2 / (4 * alpha)


def free_motion_constants(d: Design, f: Formulas, decay: Decay) -> tuple[Constant, ...]:
    """Constants of (49), (55), (57), (60), (61) and ``V_u``."""
    u_f = decay.u_f
    region = None if u_f is None else float(np.sqrt(f.inside) * np.arctanh(u_f))
    return (
        Constant("lambda_1", "(49)", f.lambda_1(d), "J", "Weight of the state in a bound of V."),
        Constant(
            "zeta_theta",
            "(49)",
            f.zeta_theta(d),
            "J",
            "What the parameter errors add to V at most.",
        ),
        Constant("V(0)", "(59)", f.V_start(d), "J", "Bound of V at the start."),
        Constant(
            "eps_x",
            "after (55)",
            decay.epsilon_x,
            "W",
            "What free motion can add to V_dot at most; it needs the upper bound of K_I.",
        ),
        Constant(
            "lambda",
            "(57)",
            decay.rate,
            "W",
            "How fast V falls at least, per |y|^2: min{beta, alpha, what k3 leaves}.",
            decay.undefined("lambda"),
        ),
        Constant(
            "|y|",
            "(60)",
            u_f,
            "mixed",
            "Radius of the region in which V can grow.",
            decay.undefined("lambda"),
        ),
        Constant(
            "|z_bar|",
            "(61)",
            region,
            "mixed",
            "Bound of the state in that region.",
            decay.undefined("lambda"),
        ),
        Constant(
            "V_u",
            "after (62)",
            None if u_f is None else V_u(d, f, u_f),
            "J",
            "Bound of V at all times.",
            decay.undefined("V_u"),
        ),
    )


def free_motion_conditions(d: Design, f: Formulas, decay: Decay) -> tuple[Condition, ...]:
    """(38), (59), (62) and (39)."""
    return (*_38(d, f, decay), *_39(d, f, decay))


def _38(d: Design, f: Formulas, decay: Decay) -> tuple[Condition, ...]:
    alpha2, rate = d.gains.alpha2, decay.rate
    load = alpha2 * decay.epsilon_x
    certain = f"the right side is at least {load / decay.ceiling:.3g}"
    return (
        Condition(
            "(38), first",
            f.statements["(38), first"],
            alpha2,
            ">",
            alpha2_floor(d.bounds.zeta_K[1], f.alpha_of_contact(d)),
            "1/s",
            "alpha2 outweighs the contact force that an error of the tip makes. It compares 1/s "
            "with N^2 s/m^2 and so depends on the units.",
        ),
        Condition(
            "(38), second",
            f.statements["(38), second"],
            alpha2,
            ">",
            None if rate is None else load / rate,
            "1/s",
            "The same as eps_x < lambda: the region in which V can grow is bounded. It compares "
            "1/s with N^2/W and so depends on the units.",
            undefined=decay.undefined("lambda", certain),
            fails=not decay.possible,
        ),
    )


def _39(d: Design, f: Formulas, decay: Decay) -> tuple[Condition, ...]:
    """(56) at the start, in the region where ``V`` can grow, and at both."""
    at_start, least = f.V_start(d), decay.least_u_f
    kept = "The feedback of r_r, saturated, outweighs r_r"
    return (
        _56(d, f, decay, "(59)", at_start, at_start, f"{kept} as large as V(0) admits."),
        _56(
            d,
            f,
            decay,
            "(62)",
            None if decay.u_f is None else V_inside(d, f, decay.u_f),
            V_inside(d, f, least),
            f"{kept} as large as V admits in the region where it can grow.",
        ),
        _56(
            d,
            f,
            decay,
            "(39)",
            None if decay.u_f is None else V_u(d, f, decay.u_f),
            V_u(d, f, least),
            f"{kept} as large as V ever gets: (56) at all times. The 1 stands for 1 m/s.",
        ),
    )


def _56(
    d: Design,
    f: Formulas,
    decay: Decay,
    number: str,
    V: float | None,
    V_least: float,
    meaning: str,
) -> Condition:
    """(56) at a value of ``V`` [J], or at what it is at least where it has none."""
    left, least = min(k3 * alpha for k3, alpha in f.axes(d)), needed(d, V_least)
    unsolvable = decay.possible and decay.rate is None and number == "(39)"
    certain = f"the right side is at least {least:.3g}"
    return Condition(
        number,
        f.statements[number],
        left,
        ">",
        None if V is None else needed(d, V),
        "N/s",
        meaning,
        undefined=decay.undefined("V_u", certain) if V is None else "",
        fails=V is None and (left <= least or unsolvable),
    )
