"""A scenario: everything that a run needs, and where its numbers come from."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

import pydantic

from alight.control import Target
from alight.control.law import Law
from alight.models import Plant
from alight.scenarios.assumptions import Assumptions
from alight.scenarios.limits import Limit
from alight.simulation.closed_loop import ClosedLoop, InitialState
from alight.symbolic.parameters import (
    Pair,
    Positive,
    Quantity,
    is_parameters,
    numeric_fields,
    parameters,
)
from alight.testbed import Testbed

Elbow = Literal["+", "-"]


@parameters
class Start:
    """Where a run starts: the tip and the mass, at rest."""

    x_r: Annotated[Pair, Quantity("m", "tip position, (40)")]
    x_m: Annotated[float, Quantity("m", "position of the mass, (40)")]
    elbow: Annotated[Elbow, Quantity("", "sign of the second joint angle")] = "+"


@dataclass(frozen=True)
class Provenance:
    """Where a number comes from: printed in the paper, or assumed."""

    kind: Literal["published", "assumed"]
    note: str
    """The equation or section, or the reason."""


@parameters
class Document:
    """What stands in a scenario file, its law still as a table."""

    plant: Plant
    testbed: Testbed
    start: Start
    target: Target
    law: dict[str, Any]
    assumptions: Assumptions | None = None
    limits: dict[str, Limit] = field(default_factory=dict)
    title: str = ""
    description: str = ""
    duration: Annotated[Positive, Quantity("s", "length of the run")] = 10.0
    steady_state: Annotated[
        Positive, Quantity("s", "last part of the run, over which steady-state peaks are taken")
    ] = 2.0
    seed: Annotated[int, Quantity("", "seed of the sensor noise"), pydantic.Field(ge=0)] = 0
    substeps: Annotated[
        Annotated[int, pydantic.Field(ge=1)] | None,
        Quantity("", "integrator steps in one sample; as few as the plant allows if absent"),
    ] = None

    def __post_init__(self) -> None:
        if self.steady_state > self.duration:
            raise ValueError(
                f"steady_state = {self.steady_state} must not be longer than "
                f"duration = {self.duration}"
            )
        step = 1 / (self.testbed.sample_rate * self.steps)
        if self.plant.tip_friction.response < step:
            raise ValueError(
                f"plant.tip_friction.response = {self.plant.tip_friction.response:g} s is shorter "
                f"than the integrator's step of {step:g} s; raise it, or substeps"
            )

    @property
    def steps(self) -> int:
        """Integrator steps in one sample: ``substeps``, or what the plant asks for.

        At 2 kHz one step that locates the switch of contact has no more error than four classical
        Runge-Kutta steps that do not; the bristle of the tip friction is stiffer and asks for two.
        """
        return self.substeps or steps_for(self.plant)


def steps_for(plant: Plant) -> int:
    """Fewest integrator steps in one sample of 0.5 ms that keep the error small."""
    return 2 if plant.tip_friction.mu > 0 else 1


def settings_of(law: Law) -> dict[str, Any]:
    """Numbers of a law as a ``[law]`` table holds them, without what it is told of the plant."""
    if not is_parameters(law):
        return {}
    table: dict[str, Any] = {}
    for path, value, _ in numeric_fields(law):
        *tables, key = path.split(".")
        if tables[:1] in (["model"], ["target"]):
            continue
        at = table
        for name in tables:
            at = at.setdefault(name, {})
        at[key] = value
    return table


@dataclass(frozen=True)
class Scenario:
    """Plant, testbed, law, start and target with numbers; the two experiments are scenarios."""

    name: str
    document: Document
    law: Law
    start: InitialState
    provenance: Mapping[str, Provenance] = field(default_factory=dict)
    """Source of each value that states one, by path."""
    data: Mapping[str, Any] = field(default_factory=dict)
    """The validated file as plain data, for recordings and reports."""

    @property
    def title(self) -> str:
        """One line about the scenario."""
        return self.document.title or self.name

    @property
    def plant(self) -> Plant:
        """The truth that is simulated."""
        return self.document.plant

    @property
    def testbed(self) -> Testbed:
        """Sensors, motors and clock."""
        return self.document.testbed

    @property
    def target(self) -> Target:
        """Where mass and tip shall come to rest."""
        return self.document.target

    @property
    def closed_loop(self) -> ClosedLoop:
        """What is built and run."""
        return ClosedLoop(self.plant, self.testbed, self.law, self.document.steps)

    def with_law(self, law: Law) -> Scenario:
        """Return the same scenario under another law."""
        cls = type(law)
        named = {"type": f"{cls.__module__}:{cls.__qualname__}", **settings_of(law)}
        return dataclasses.replace(self, law=law, data={**self.data, "law": named})

    def description(self) -> dict[str, Any]:
        """Values and sources as plain data: what a recording keeps of its scenario."""
        sources = {path: dataclasses.asdict(source) for path, source in self.provenance.items()}
        return {"name": self.name, **self.data, "provenance": sources}
