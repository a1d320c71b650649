"""Proposition D: (57) forces contact, without (65)-(70).

Suppose (57), ``V_dot <= -lambda |y|^2 + eps_x``, and no contact after some time. ``V`` being
nonnegative, the time average of ``lambda |y|^2`` then is at most ``eps_x`` in the limit. But the
free mass of (3) swings about ``x_0``: ``e_m = d + A cos(omega t + phi)`` with ``d = x_md - x_0``,
and ``|y| >= |tanh(e_m)|``. Take the instants of a period in pairs ``d + delta`` and ``d - delta``.
With ``t = tanh(d)`` and ``x = tanh^2(delta)`` the mean of ``tanh^2`` over a pair is

    h(x) = (t^2 (1 - x)^2 + x (1 - t^2)^2) / (1 - t^2 x)^2,

and ``h(x) - t^2`` has the sign of ``1 - 3 t^2 + t^2 (1 + t^2) x``. So for ``3 t^2 <= 1``, that is
``|d| <= 0.658 m``, the average is at least ``tanh^2(d)`` at *every* amplitude: that ``tanh^2`` is
convex up to 0.658 (Jensen) is not needed of the whole swing. Beyond, ``h`` is least at
``x = (3 t^2 - 1) / (t^2 (3 - t^2))``, where it is ``(6 t^2 - 1 - t^4) / (8 t^2)``. In both cases
``eps_x`` below ``lambda`` times that floor contradicts the average: contact occurs. Beyond 0.658 m
the floor is that of the worst pair, which is valid but not the largest possible for a whole swing.
"""

from __future__ import annotations

from alight.symbolic.ops import tanh
from alight.theory.condition import Condition


def swing_floor(d: float) -> float:
    """Lower bound of the time average of ``tanh^2(e_m)`` of a free swing about ``d``.

    It holds at every amplitude; ``d`` is ``x_md - x_0`` [m]. Up to 0.658 m it is the largest that
    does: small swings come as near as one likes. Beyond it is valid, and not the largest possible:
    no swing keeps all of its pairs at the worst ``delta``.
    """
    t2 = float(tanh(d)) ** 2
    return t2 if 3 * t2 <= 1 else (6 * t2 - 1 - t2**2) / (8 * t2)


def contact_from_V(
    eps_x: float | None, lambda_: float | None, d: float, undefined: str = ""
) -> Condition:
    """Condition of Proposition D, ``eps_x < lambda tanh^2(d)`` for ``|d| <= 0.658 m``.

    Parameters
    ----------
    eps_x, lambda_ : float or None
        Those of (57); None where they have no value.
    d : float
        ``x_md - x_0`` [m].
    undefined : str
        Why ``eps_x`` or ``lambda_`` has no value.
    """
    return Condition(
        number="D",
        statement="eps_x < lambda tanh^2(x_md - x_0)",
        left=eps_x,
        relation="<",
        right=None if lambda_ is None else lambda_ * swing_floor(d),
        unit="W",
        meaning="Contact follows from (57) alone, without (65)-(70), also of a mass that swings; "
        "Theorem 1 does not imply it.",
        undefined=undefined,
    )
