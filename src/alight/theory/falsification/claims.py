"""What is claimed: the functions of the project that the searches attack."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from alight.theory import lyapunov, proven
from alight.theory.proven.first_contact import first_contact_of
from alight.theory.theorem_1.formulas import Corrected, Formulas
from alight.theory.theorem_1.nonlinear_damping import zeta_1

Function = Callable[..., Any]


CORRECTED = Corrected()


@dataclass(frozen=True)
class Claims:
    """The claims under attack; put others in their place to see a search find what is wrong."""

    dissipation: Function = lyapunov.dissipation
    """By how much ``V_r`` falls at least."""
    outside: float = 0.0
    """How far the truth may lie outside of its boxes, as a share of their widths."""
    r_r_squared: Function = lambda V_r, mobility: 2 * V_r * mobility
    """Bound of ``r_ri^2`` from ``V_r`` and ``(M_bar^-1)_ii``."""
    steepness: Function = lambda e, f: e / f
    """Quotient of ``e^2`` and ``e f(e)`` up to an error ``e`` with feedback ``f(e)``, at most."""
    tracking: Function = lambda r, f: r / f
    """What ``alpha_i`` must exceed where the feedback of ``r`` is ``f``: replaces (39)."""
    vtx_margin: Function = proven.vtx_margin
    loc_margin: Function = proven.loc_margin
    decisive: tuple[int, ...] = (4, 5, 7, 8)
    """States whose linearisation decides over the loop: mass, filter and ``theta_dk_hat``."""
    loc_adapting_margin: Function = proven.loc_adapting_margin
    filter_room: Function = proven.filter_room
    least_lead: Function = lambda gains, w: 0.0
    """What ``s_inf`` exceeds, at ``w = tanh(x_md - x_0)``."""
    approach: Function = lambda law, s, f: law.gains.alpha[0] * s * f
    """By how much ``V_r`` falls at least while the tip is behind a lead ``s`` with feedback
    ``f(s)``."""
    first_contact: Function = first_contact_of
    swing_floor: Function = proven.swing_floor
    edge: float = 1.0
    """Where the projection points inwards, as a share of the layer of the widened interval."""
    formulas: Formulas = CORRECTED
    zeta_1: Function = zeta_1
    of_eta: Function = lambda alpha2, K_I, alpha_1: 2 * alpha2 - K_I**2 / (4 * alpha_1)
    """What (71) has before ``eta_m^2``."""
    stiffness: float = 1.0
    """Contact stiffness at which no design is feasible, over the limit of the joint inequality."""
