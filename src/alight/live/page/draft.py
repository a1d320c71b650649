"""A draft of the law's parameters: what the fields hold before it is applied."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from alight.errors import AlightError, InvalidParameters
from alight.live.bank import Bank
from alight.live.page.fields import Field, value_at
from alight.models.arm import Elbow
from alight.simulation.closed_loop import ClosedLoop
from alight.symbolic.parameters import numeric_fields, replaced

SHARED = ("gains", "target", "Gamma_r", "theta_dk", "theta_r", "e_f")
"""What one law takes over from another: all that is no description of the plant."""


@dataclass
class Draft:
    """Values that differ from those in force, and what is wrong with them."""

    bank: Bank
    number: int
    """Number of the law that the draft is of."""
    base: ClosedLoop
    """That law with the values that it would have without the draft."""
    texts: dict[str, str] = field(default_factory=dict)
    """What stands in each field that was touched."""
    problems: dict[str, str] = field(default_factory=dict)
    """What is wrong with a field, by its key; under the empty key with all of them together."""
    values: dict[str, float] = field(default_factory=dict)
    """Valid values of fields that were touched, by key."""

    def set(self, item: Field, text: str) -> None:
        """Take what was typed into a field."""
        self.texts[item.key] = text
        self.values.pop(item.key, None)
        self.problems.pop(item.key, None)
        try:
            value = float(text.strip().replace(",", "."))
        except ValueError:
            self.problems[item.key] = "is not a number"
            return
        if problem := item.bounds.problem(value):
            self.problems[item.key] = problem
        elif value == item.of(self.base):
            self.texts.pop(item.key)
        else:
            self.values[item.key] = value

    def revert(self) -> None:
        """Forget everything that was typed."""
        self.texts.clear()
        self.values.clear()
        self.problems.clear()

    @property
    def changed(self) -> dict[str, Any]:
        """New values by path; vectors as a whole."""
        found: dict[str, Any] = {}
        for key, value in self.values.items():
            path, _, entry = key.rpartition(".")
            if not entry.isdecimal():
                found[key] = value
                continue
            whole = list(found.get(path, value_at(self.base, path)))
            whole[int(entry)] = value
            found[path] = tuple(whole)
        return found

    def loop(self) -> ClosedLoop | None:
        """The closed loop that the draft describes; None if anything is wrong with it."""
        self.problems.pop("", None)
        if self.problems:
            return None
        try:
            made: ClosedLoop = replaced(self.base, self.changed)
            _refuse_out_of_reach(made, self.bank.scenario.document.start.elbow)
        except InvalidParameters as error:
            self.problems[""] = "; ".join(error.problems)
            return None
        except AlightError as error:
            self.problems[""] = str(error)
            return None
        return made


def _refuse_out_of_reach(loop: ClosedLoop, elbow: Elbow) -> None:
    """Refuse a target that the arm cannot reach, as a scenario's target is."""
    target = getattr(loop.law, "target", None)
    if target is not None:
        loop.plant.arm.inverse(np.array([target.x_md, target.x_rd2]), elbow)


def taking_over(bank: Bank, number: int, before: ClosedLoop) -> ClosedLoop:
    """A law of the bank with the gains, target and boxes that another one had in force."""
    loop = bank.loops[number]
    values: Mapping[str, Any] = {
        path: value
        for path, value, _ in numeric_fields(before.law, "law.")
        if path.split(".")[1] in SHARED
    }
    own = {path for path, _, _ in numeric_fields(loop.law, "law.")}
    made: ClosedLoop = replaced(loop, {p: v for p, v in values.items() if p in own})
    return made
