"""The adaptation step of one sample, against the tolerance of the projection and against V_r.

In continuous time the projection keeps an estimate within its bounds widened by ``epsilon``. An
Euler step can leap over that layer. It does not where

    T |mu| <= epsilon / (n + 1),

``n`` being the order of the projection, ``epsilon`` at most half the interval ``h`` of the bounds.
For let ``theta`` lie ``(1 - t) epsilon`` beyond the upper bound, ``0 <= t <= 1``, and ``mu > 0``.
With ``c = epsilon / h`` the projection gives at most ``mu (1 - p)``,

    p = ((1 - t) (1 - c t / (2 + c)))^(n+1) (1 + c (1 - t))^2,

and the step ends within the layer if ``T mu (1 - p) <= t epsilon``. Where ``(n + 1) t >= 1`` it
does, since ``1 - p <= 1``. Where ``(n + 1) t < 1``, by Bernoulli ``(1 - t)^(n+1) >= 1 - (n + 1) t``
and the other two factors are at least ``2 / (2 + c)`` and ``(1 + c / 2)^2``, together above 1, so
that ``1 - p <= (n + 1) t``. From within the bounds a step of ``epsilon / (n + 1)`` does not cross
the layer. No step reaches the far side: inwards the projection adds at most ``(3/2) epsilon`` and a
leak, ``T leak (h + epsilon) / 2``, which must be short against ``h``. The bound is sharp as ``c``
tends to 0: beyond it a thin layer is left from just below its border.
Where the bound is passed, the clip of `Estimate.clip` is what keeps the estimate in place; it
never takes the estimate farther from a truth within the bounds.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from alight.control import AdaptiveContactLaw, AdaptiveState, Estimate
from alight.control.measurement import Measurement
from alight.simulation.closed_loop import MEASURED
from alight.simulation.recording import Recording
from alight.symbolic.build import build
from alight.symbolic.ops import as_vector, dot
from alight.symbolic.signals import Layout
from alight.theory.lyapunov import dissipation


@dataclass(frozen=True)
class AdaptationSteps:
    """Largest adaptation steps along a recording."""

    columns: tuple[str, ...]
    """The estimates, one name each."""
    ratio: np.ndarray
    """Per estimate the largest ``T |mu|`` over ``epsilon / (n + 1)``."""
    clipped: np.ndarray
    """Per estimate the share of the samples in which it stands where the clip stopped it."""
    beyond: float
    """Share of the samples in which at least one estimate passes that tolerance."""
    outrun: float
    """Share of the samples in which the Euler step adds to ``V_r`` more than the feedback takes.

    That is ``T |Gamma_r^(1/2) Y_r^T r_r|^2 > 2 (r_r^T k3 Tanh(r_r) + e_r^T alpha Tanh(e_r))``.
    """


def adaptation_steps(law: AdaptiveContactLaw, recording: Recording, T: float) -> AdaptationSteps:
    """Evaluate the adaptation of a law along a recording of its loop, sampled every ``T`` seconds.

    ``mu`` is the rate before projection, from the recorded measurements and estimates.
    """
    memory = Layout(law.states)
    measured = [recording[f"{name}_measured"] for name in MEASURED.signals]
    state = [recording[name] for name in law.states]
    seen, known = (np.column_stack(parts).T for parts in (measured, state))
    function = _along(law)
    mu_dk, mu_r, euler, decrease = (np.asarray(v) for v in function.map(seen.shape[1])(seen, known))
    steps = T * np.abs(np.vstack([mu_dk, mu_r])).T
    ratios = steps / np.concatenate([_tolerance(law.theta_dk), _tolerance(law.theta_r)])
    names = [n for n in memory.columns if n.startswith("theta_")]
    return AdaptationSteps(
        columns=tuple(names),
        ratio=ratios.max(axis=0),
        clipped=np.concatenate(
            [
                _clipped(law.theta_dk, recording["theta_dk_hat"]),
                _clipped(law.theta_r, recording["theta_r_hat"]),
            ]
        ),
        beyond=float(np.mean((ratios > 1).any(axis=1))),
        outrun=float(np.mean(T * euler > 2 * decrease)),
    )


def _tolerance(box: Estimate) -> np.ndarray:
    """Largest Euler step that the projection of an estimate answers for."""
    return np.atleast_1d(np.asarray(box.epsilon)) / (box.order + 1)


def _clipped(box: Estimate, estimates: np.ndarray) -> np.ndarray:
    """Share of the samples at an end of the widened bounds, to rounding."""
    low, high = (np.asarray(end) for end in box.widened)
    rounding = 1e-9 * (high - low)
    stopped = (estimates <= low + rounding) | (estimates >= high - rounding)
    return np.atleast_1d(stopped.mean(axis=0))


def _along(law: AdaptiveContactLaw) -> ca.Function:
    layout = Layout(law.states)
    seen, known = ca.SX.sym("measured", MEASURED.size), ca.SX.sym("state", layout.size)
    measured = Measurement(**MEASURED.unpack(seen))
    a = AdaptiveState(**layout.unpack(known))
    e = law.errors(measured, a.u_f, a.theta_dk_hat)
    Y_r = law.Y_r(measured, e)
    mu_r = law.mu_r(Y_r, e.r_r)
    outputs: dict[str, Any] = {
        "mu_dk": law.mu_dk(measured.x_m, e.eta_m),
        "mu_r": mu_r,
        "euler": dot(mu_r, mu_r / as_vector(law.Gamma_r)),
        "dissipation": dissipation(law, e),
    }
    return build("adaptation", {"measured": seen, "state": known}, outputs)
