"""What a certificate is about: a law at the start of a run, on a plant known within bounds."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from alight.control import AdaptiveContactLaw, AdaptiveState
from alight.control.transition import Errors
from alight.errors import AlightError
from alight.models import Plant, PlantState
from alight.scenarios import Scenario
from alight.scenarios.assumptions import Assumptions
from alight.theory.inertia import InertiaBounds, inertia_bounds, inertia_box
from alight.theory.lossless import lossless
from alight.theory.lyapunov import errors_at


@dataclass(frozen=True)
class Case:
    """A law, what its designer knows, and the state in which a run starts."""

    law: AdaptiveContactLaw
    """Gains, target, boxes and first estimates; what it is told of the plant is not used."""
    bounds: Assumptions
    inertia: InertiaBounds
    """Bounds of the task-space inertia over the box of ``theta_r`` and all poses."""
    plant: Plant
    """The truth without its dissipation: for comparison, never for a bound."""
    s: PlantState
    a: AdaptiveState

    @property
    def e(self) -> Errors:
        """Errors at the start."""
        return errors_at(self.law, self.s, self.a)

    @property
    def compression(self) -> float:
        """Compression of the spring at the set point, ``x_md - x_0`` [m]: ``e_m`` at rest."""
        return float(self.law.model.body.Y_d(self.law.target.x_md))


def case_of(scenario: Scenario) -> Case:
    """The case that a scenario states.

    Raises
    ------
    AlightError
        If its law is not adaptive, it states no assumptions, or these admit no bound.
    """
    law, bounds = scenario.law, scenario.document.assumptions
    if not isinstance(law, AdaptiveContactLaw):
        raise AlightError(
            f"{scenario.name}: law.type = {scenario.document.law['type']!r}: a certificate needs "
            "an adaptive law on the paper's error system, such as force-limiting or unsaturated"
        )
    if bounds is None:
        raise AlightError(
            f"{scenario.name}: assumptions: missing; a certificate rests on what is known of the "
            "plant. Add a table [assumptions] with m_l, m_u, zeta_K, zeta_ks, zeta_xr, zeta_xm "
            "and sigma_J, such as that of experiment-1"
        )
    start = scenario.start
    plant = lossless(scenario.plant)
    return Case(
        law=law,
        bounds=bounds,
        inertia=inertia_bounds(plant.arm, *inertia_box(law), bounds.sigma_J, bounds.a1),
        plant=plant,
        s=PlantState(np.array(start.q), np.array(start.q_dot), start.x_m, start.x_m_dot, 0.0),
        a=AdaptiveState(**law.initial_state()),
    )
