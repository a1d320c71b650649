"""Which forces the law can still command at an instant, whatever its estimates become."""

from __future__ import annotations

from alight.control import AdaptiveContactLaw, AdaptiveState, Measurement
from alight.symbolic.ops import Vector, fabs


def force_interval(
    law: AdaptiveContactLaw, measured: Measurement, state: AdaptiveState
) -> tuple[Vector, Vector]:
    """Interval [N] of the commanded force over every estimate that the projection admits.

    ``F = Y_r theta_r_hat + feedback`` at this instant, with each entry of ``theta_r_hat`` anywhere
    in its widened interval; that of ``state`` is not read. A run-time monitor builds it once on
    symbols.

    Parameters
    ----------
    law : AdaptiveContactLaw
        Its box ``theta_r``, widened by the layer of the projection, bounds the estimates.
    measured : Measurement
        What the sensors show.
    state : AdaptiveState
        Filter state and ``theta_dk_hat`` of the law.

    Returns
    -------
    (2,) vectors
        Lower and upper end, per axis.
    """
    e = law.errors(measured, state.u_f, state.theta_dk_hat)
    Y_r = law.Y_r(measured, e)
    low, high = law.theta_r.widened
    middle = Y_r @ ((low + high) / 2) + law.feedback(e.e_r, e.r_r)
    reach = fabs(Y_r) @ ((high - low) / 2)
    return middle - reach, middle + reach
