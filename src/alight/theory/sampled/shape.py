"""A law without its numbers: what a function of them depends on."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, field

from alight.control import AdaptiveContactLaw
from alight.symbolic.parameters import structure_of


@dataclass(frozen=True)
class Shape:
    """A law that equals every other one of its structure: its numbers do not count."""

    law: AdaptiveContactLaw = field(compare=False)
    structure: Hashable

    @classmethod
    def of(cls, law: AdaptiveContactLaw) -> Shape:
        """The shape of a law."""
        return cls(law, structure_of(law))
