"""(26), (37), (38) and (70) hold together for almost no contact.

Write ``p = zeta_K_upper zeta_xm``, ``w = tanh(eps_m)``, ``kappa = 4 alpha2^2 k_n1`` and
``t = tanh(eps_f) = sqrt(eps_x / lambda)``.

1. ``zeta_1 >= m_u alpha2^2``: let ``e_m`` grow with ``e_f = eta_m = 0``. By (37)
   ``k_n1 > 1 / (4 alpha2^2)``, so ``kappa > 1``; and ``beta <= alpha2 - 1 / (4 alpha2 k_n1)``, so
   ``lambda <= alpha2 (1 - 1 / kappa)``.
2. By (26) ``k1 >= 3 / m_l + k_n1 alpha2^4 m_l >= 2 sqrt(3 k_n1) alpha2^2 = sqrt(3 kappa) alpha2``,
   the mean of two numbers being no less than their geometric one.

*As printed.* ``t^2 = p^2 / (alpha2 lambda) >= c^2 / alpha2^2``, ``c^2 = p^2 kappa / (kappa - 1)``.
(70) for k1 is ``w > k1 / (1 - t^2) >= sqrt(3 kappa) alpha2^3 / (alpha2^2 - c^2)``; over
``alpha2 > c`` this is least at ``alpha2 = sqrt(3) c``, where it is
``sqrt(3 kappa) (3 sqrt(3) / 2) c = (9/2) p kappa / sqrt(kappa - 1)``, and that is least at
``kappa = 2``. Hence **9 zeta_K_upper zeta_xm < tanh(eps_m)**. Also ``w > k1 > 3 / m_l``.

*As corrected.* With ``p`` for ``zeta_K_upper (zeta_xm - zeta_xr) / 2`` ``t`` is as before, and
(70) for k1 is ``w > k1 t / (1 - t^2) >= k1 t >= sqrt(3) p kappa / sqrt(kappa - 1)``, and that is
at least ``2 sqrt(3) p``. Hence **sqrt(3) zeta_K_upper (zeta_xm - zeta_xr) < tanh(eps_m)**, and no
condition on the mass.

Both are sharp. Take ``m_u`` and ``zeta_K`` hardly apart and ``kappa = 2``, ``alpha1`` and
``alpha3`` small, ``k2`` so large that ``alpha2`` is the least in (37), ``alpha`` and ``k3`` large.
As printed then ``alpha2 = sqrt(6) p``, ``k1 = 6 p``, ``m = 1 / p``; as corrected ``alpha2`` large,
``k1 = sqrt(6) alpha2``, ``m = sqrt(6) / alpha2``: every step above is an equality in the limit.
"""

from __future__ import annotations

import numpy as np

from alight.symbolic.ops import tanh
from alight.theory.condition import Condition
from alight.theory.theorem_1.design import Design
from alight.theory.theorem_1.formulas import Formulas, Printed

TOGETHER = "(26), (37), (38), (70)"


def stiffness_limit(d: Design, f: Formulas) -> float:
    """Stiffness [N/m] that ``zeta_K_upper`` must be below for any gains to do."""
    w, b = float(tanh(d.e_m_rest)), d.bounds
    if isinstance(f, Printed):
        return w / (9 * b.zeta_xm)
    return w / (float(np.sqrt(3)) * (b.zeta_xm - b.zeta_xr))


def joint_conditions(d: Design, f: Formulas) -> tuple[Condition, ...]:
    """What (26), (37), (38) and (70) imply together, whatever the gains."""
    w, printed = float(tanh(d.e_m_rest)), isinstance(f, Printed)
    stiffness = Condition(
        TOGETHER,
        "9 zeta_K_upper zeta_xm < tanh(eps_m)"
        if printed
        else "sqrt(3) zeta_K_upper (zeta_xm - zeta_xr) < tanh(eps_m)",
        w * d.bounds.zeta_K[1] / stiffness_limit(d, f),
        "<",
        w,
        "N",
        "Necessary for all four whatever the gains and the mass; where it holds there are gains "
        "and a mass for which they hold.",
    )
    if not printed:
        return (stiffness,)
    mass = Condition(
        TOGETHER,
        "m_l > 3 / tanh(eps_m)",
        d.bounds.m_l,
        ">",
        3 / w if w > 0 else None,
        "kg",
        "Necessary: (26) keeps k1 above 3 / m_l, and (70) keeps it below tanh(eps_m).",
        undefined="" if w > 0 else "the set point is not beyond the rest position: no k1 will do",
        fails=w <= 0,
    )
    return stiffness, mass
