"""Numbers of a scenario that differ from run to run: checked, and brought to where they act."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from typing import Any, get_type_hints

import numpy as np
import pydantic

from alight.errors import AlightError, InvalidParameters
from alight.models.arm import Arm
from alight.scenarios.scenario import Scenario, steps_for
from alight.simulation.batch import Runs
from alight.simulation.closed_loop import ClosedLoop
from alight.symbolic.parameters import is_parameters, numeric_fields, problems_of

Varied = Mapping[str, Any]
"""Values by path, an array each whose first axis counts the runs."""
SHARED = ("testbed.sample_rate",)
"""What all runs of a batch have in common: they tick together."""
SEED = "seed"
MOST = 5
"""Refused values that are shown."""


class Variation:
    """The varied numbers of a scenario.

    Raises
    ------
    InvalidParameters
        If a path is no number of the scenario, an array has another shape, or a value is refused.
    """

    def __init__(self, scenario: Scenario, varied: Varied) -> None:
        self.scenario = scenario
        self.fields = _fields(scenario)
        if not varied:
            raise InvalidParameters("varied", ["nothing varies; name at least one path"])
        arrays = {path: _array(path, values) for path, values in varied.items()}
        self.count = _count(arrays)
        self.seeds = _seeds(arrays.pop(SEED, None), scenario.document.seed, self.count)
        self.values = {path: self._checked(path, array) for path, array in arrays.items()}
        self._refuse_together()
        self._refuse_stiff()

    def of(self, path: str) -> np.ndarray:
        """Values of a number in each run, (n,) or (n, size), varied or not."""
        if path in self.values:
            return self.values[path]
        base = np.asarray(self.fields[path], dtype=float)
        return np.broadcast_to(base, (self.count, *base.shape))

    def _checked(self, path: str, array: np.ndarray) -> np.ndarray:
        """Values of one path as numbers, each within the bounds of its field."""
        if path in SHARED:
            raise InvalidParameters("varied", [f"{path}: is shared by all runs of a batch"])
        if path not in self.fields:
            raise InvalidParameters("varied", [f"{path}: {_no_number(path, self.fields)}"])
        shape = (self.count, *np.shape(self.fields[path]))
        if array.shape != shape or array.dtype.kind not in "fiu":
            raise InvalidParameters(
                "varied",
                [f"{path}: has shape {array.shape} of {array.dtype}; needs numbers, shape {shape}"],
            )
        owner, name = self._owner(path)
        hint = get_type_hints(type(owner), include_extras=True)[name]
        values = [tuple(row) if array.ndim > 1 else row for row in array.astype(float).tolist()]
        config = pydantic.ConfigDict(allow_inf_nan=False)
        adapter = pydantic.TypeAdapter(list[hint], config=config)  # type: ignore[valid-type]
        try:
            adapter.validate_python(values)
        except pydantic.ValidationError as error:
            lines = problems_of(error)
            raise InvalidParameters("varied", _shown(f"{path}, run {x}" for x in lines)) from None
        return array.astype(float)

    def _owner(self, path: str) -> tuple[Any, str]:
        """The parameter set that holds a number, and the number's name there."""
        root, *middle, name = path.split(".")
        roots = {"law": self.scenario.law, **_documents(self.scenario)}
        owner = roots[root]
        for step in middle:
            owner = getattr(owner, step)
        return owner, name

    def _refuse_together(self) -> None:
        """Refuse numbers that only together are wrong, as an inertia that is not positive."""
        owners: dict[str, list[str]] = {}
        for path in self.values:
            owners.setdefault(path.rpartition(".")[0], []).append(path)
        problems: list[str] = []
        for prefix, paths in owners.items():
            owner, _ = self._owner(paths[0])
            if not hasattr(owner, "__post_init__"):
                continue
            for run in range(self.count):
                changed = {p.rpartition(".")[2]: _plain(self.values[p][run]) for p in paths}
                try:
                    dataclasses.replace(owner, **changed)
                except InvalidParameters as error:
                    problems += [f"{prefix}, run {run}: {line}" for line in error.problems]
        if problems:
            raise InvalidParameters("varied", _shown(iter(problems)))

    def _refuse_stiff(self) -> None:
        """Refuse a bristle that the integrator cannot follow, as a scenario does."""
        step, response = self.loop.dt / self.loop.substeps, self.of("plant.tip_friction.response")
        problems = (
            f"plant.tip_friction.response, run {run} = {response[run]:g}: is shorter than the "
            f"integrator's step of {step:g} s; raise it, or substeps"
            for run in np.flatnonzero(response < step)
        )
        if lines := _shown(problems):
            raise InvalidParameters("varied", lines)

    # What a batch is made of

    @property
    def loop(self) -> ClosedLoop:
        """The loop of the scenario, with as many integrator steps as any of the runs asks for."""
        loop, document = self.scenario.closed_loop, self.scenario.document
        if document.substeps is not None:
            return loop
        plant, mu = document.plant, float(np.max(self.of("plant.tip_friction.mu")))
        roughest = dataclasses.replace(plant.tip_friction, mu=mu)
        steps = steps_for(dataclasses.replace(plant, tip_friction=roughest))
        return dataclasses.replace(loop, substeps=steps)

    def runs(self) -> Runs:
        """The runs of the batch."""
        travel = np.abs(self.of("target.x_md") - self.of("plant.body.x_0"))
        return Runs(self._starts(), self._parameters(), travel, self.seeds)

    def _parameters(self) -> dict[str, np.ndarray]:
        """Values by path in the loop; what the law is told of plant and target varies along."""
        known = {
            path
            for name, part in self.scenario.closed_loop.parameters().items()
            for path, _, _ in numeric_fields(part, f"{name}.")
        }
        found = {}
        for path, values in self.values.items():
            places = {path, f"law.{path}", path.replace("plant.", "law.model.", 1)}
            for place in places & known:
                found[place] = values.T
        return found

    def _starts(self) -> np.ndarray:
        """Start of each run, in the order of `InitialState`."""
        start = self.scenario.start
        column = np.array([*start.q, start.x_m, *start.q_dot, start.x_m_dot])
        starts = np.repeat(column[:, None], self.count, axis=1)
        starts[2] = self.of("start.x_m")
        posed = {"start.x_r", "plant.arm.l1", "plant.arm.l2"} & self.values.keys()
        aimed = {"target.x_md", "target.x_rd2", "plant.arm.l1", "plant.arm.l2"} & self.values.keys()
        elbow = self.scenario.document.start.elbow
        problems = []
        for run in range(self.count) if posed or aimed else ():
            try:
                arm = self._arm(run)
                starts[:2, run] = arm.inverse(self.of("start.x_r")[run], elbow)
                aim = self.of("target.x_md")[run], self.of("target.x_rd2")[run]
                arm.inverse(np.array(aim), elbow)
            except AlightError as error:
                problems.append(f"run {run}: {error}")
        if problems:
            raise InvalidParameters("varied", _shown(iter(problems)))
        return starts

    def _arm(self, run: int) -> Arm:
        l1, l2 = (float(self.of(f"plant.arm.{name}")[run]) for name in ("l1", "l2"))
        return dataclasses.replace(self.scenario.plant.arm, l1=l1, l2=l2)


def _documents(scenario: Scenario) -> dict[str, Any]:
    document = scenario.document
    return {name: getattr(document, name) for name in ("plant", "testbed", "start", "target")}


def _fields(scenario: Scenario) -> dict[str, Any]:
    """Value of each number of a scenario that may vary, by path."""
    found: dict[str, Any] = {}
    for name, part in _documents(scenario).items():
        found.update({path: value for path, value, _ in numeric_fields(part, f"{name}.")})
    law = numeric_fields(scenario.law, "law.") if is_parameters(scenario.law) else ()
    for path, value, _ in law:
        if not path.startswith(("law.model.", "law.target.")):
            found[path] = value
    return found


def _no_number(path: str, fields: Mapping[str, Any]) -> str:
    return f"is no number of this scenario that may vary; these are: {SEED}, {', '.join(fields)}"


def _count(arrays: Mapping[str, np.ndarray]) -> int:
    """Number of runs: the length of every array."""
    lengths = {path: len(array) if array.ndim else 0 for path, array in arrays.items()}
    if len(set(lengths.values())) > 1 or 0 in lengths.values():
        told = ", ".join(f"{path}: {length}" for path, length in lengths.items())
        raise InvalidParameters("varied", [f"arrays must be of one length, at least 1; {told}"])
    return next(iter(lengths.values()))


def _array(path: str, values: Any) -> np.ndarray:
    try:
        return np.asarray(values)
    except ValueError:
        problem = f"{path}: its values are not of one length; needs as many for each run"
        raise InvalidParameters("varied", [problem]) from None


def _seeds(given: np.ndarray | None, seed: int, count: int) -> np.ndarray:
    if given is None:
        return np.full(count, seed)
    if given.shape != (count,) or given.dtype.kind not in "iu" or (given < 0).any():
        raise InvalidParameters("varied", [f"{SEED}: must be whole numbers, 0 or more, one a run"])
    return given


def _plain(value: Any) -> Any:
    return tuple(value.tolist()) if np.ndim(value) else float(value)


def _shown(problems: Iterator[str]) -> list[str]:
    """The first problems, and how many there are."""
    lines = list(problems)
    rest = len(lines) - MOST
    return lines if rest <= 0 else [*lines[:MOST], f"and {rest} more"]
