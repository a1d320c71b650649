"""The certificate of a scenario: what is assumed, what follows, and how far that goes."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from alight.control import Gains
from alight.errors import AlightError
from alight.scenarios import Scenario, load_scenario, simulate
from alight.simulation import Recording
from alight.theory.assumed import Assumed, assumed
from alight.theory.case import Case, case_of
from alight.theory.condition import Condition, Constant
from alight.theory.newtons import Bound, Trace, bounds_in_newtons, lyapunov_along
from alight.theory.proven import constants, contact_from_V, nearest_vtx_of, propositions
from alight.theory.region import Region, region
from alight.theory.sampled import Sampled, sampled
from alight.theory.theorem_1 import Theorem1, theorem_1


@dataclass(frozen=True)
class Certificate:
    """Everything that can be said of a scenario before it runs, beside one simulated run of it."""

    scenario: Scenario
    case: Case
    recording: Recording
    """The run that bounds are compared with."""
    assumed: tuple[Assumed, ...]
    """The assumptions, and what the scenario has instead."""
    theorem_1: Theorem1
    """The paper's conditions, as printed and as corrected."""
    constants: tuple[Constant, ...]
    """What Propositions A to C bound."""
    propositions: tuple[Condition, ...]
    """LOC, VTX, Proposition D and what else is proven."""
    nearest: Gains | None
    """The gains nearest to those of the scenario that satisfy VTX; None if none was found."""
    sampled: Sampled
    """The law at its sample rate."""
    newtons: tuple[Bound, ...]
    """Bounds of forces, torques and errors."""

    def condition(self, number: str) -> Condition:
        """The proven condition of a name, such as ``"VTX"``; `KeyError` if there is none."""
        return {made.number: made for made in self.propositions}[number]

    @property
    def certified(self) -> bool:
        """Whether first contact, convergence in lasting contact and the sampled loop are safe.

        That is: LOC with adaptation, VTX and the domain of the filter hold over the assumptions,
        the truth lies within them, and the sampled loop is locally stable in both phases.
        """
        needed = ("LOC", "LOC, adapting", "VTX", "filter")
        proven = all(self.condition(number).holds for number in needed)
        known = all(line.holds for line in self.assumed if line.about == "knowledge")
        return proven and known and self.sampled.stable

    @property
    def lyapunov(self) -> dict[str, Trace]:
        """``V``, ``V_r`` and ``V_m`` along the run, with their bounds."""
        return lyapunov_along(self.case, self.recording)

    @property
    def region(self) -> Region:
        """Where LOC and VTX hold around the gains of the scenario and the nearest ones."""
        return region(self.case, self.nearest or self.case.law.gains)

    def as_dict(self) -> dict[str, Any]:
        """The certificate as plain data in SI units."""
        return {
            "scenario": self.scenario.name,
            "title": self.scenario.title,
            "certified": self.certified,
            "assumptions": [dataclasses.asdict(line) for line in self.assumed],
            "theorem_1": {
                name: {
                    "holds": reading.holds,
                    "constants": [dataclasses.asdict(c) for c in reading.constants],
                    "conditions": [judged(c) for c in reading.conditions],
                    "joint": [judged(c) for c in reading.joint],
                }
                for name, reading in (
                    ("printed", self.theorem_1.printed),
                    ("corrected", self.theorem_1.corrected),
                )
            },
            "proven": {
                "constants": [dataclasses.asdict(c) for c in self.constants],
                "conditions": [judged(c) for c in self.propositions],
                "nearest_gains_with_VTX": (
                    None if self.nearest is None else dataclasses.asdict(self.nearest)
                ),
            },
            "sampled": self.sampled.as_dict(),
            "newtons": [
                {**dataclasses.asdict(b), "ratio": b.ratio, "vacuous": b.vacuous}
                for b in self.newtons
            ],
        }


def judged(condition: Condition) -> dict[str, Any]:
    """A condition as plain data, with what follows from its sides."""
    return {
        **dataclasses.asdict(condition),
        "margin": condition.margin,
        "holds": condition.holds,
    }


def check(subject: Scenario | str | Path) -> Certificate:
    """Certify a scenario: which conditions hold, with margins, and what follows from them.

    Parameters
    ----------
    subject : Scenario, or name or path of one
        With an adaptive law and a table ``[assumptions]``. It is run once, for comparison.

    Raises
    ------
    AlightError
        If its law is not adaptive, it states no assumptions, or these admit no bound.
    """
    scenario = subject if isinstance(subject, Scenario) else load_scenario(subject)
    case = case_of(scenario)
    recording = _numbers(simulate(scenario))
    theorem = theorem_1(case)
    return Certificate(
        scenario=scenario,
        case=case,
        recording=recording,
        assumed=assumed(case, scenario, recording),
        theorem_1=theorem,
        constants=constants(case),
        propositions=(*propositions(case), _contact_from_V(case, theorem)),
        nearest=_nearest(case),
        sampled=sampled(case, scenario, recording),
        newtons=bounds_in_newtons(case, scenario, recording),
    )


def _contact_from_V(case: Case, theorem: Theorem1) -> Condition:
    """Proposition D at the constants of Theorem 1 as corrected."""
    eps_x, rate = (theorem.corrected.constant(symbol) for symbol in ("eps_x", "lambda"))
    return contact_from_V(eps_x.value, rate.value, case.compression, rate.undefined)


def _nearest(case: Case) -> Gains | None:
    try:
        return nearest_vtx_of(case)
    except AlightError:
        return None


def _numbers(recording: Recording) -> Recording:
    """Leave out the samples of a run that broke up which hold no numbers."""
    kept = np.isfinite(recording.samples).all(axis=1)
    return dataclasses.replace(recording, t=recording.t[kept], samples=recording.samples[kept])
