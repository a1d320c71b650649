"""The verb: attack every claim, or those of some propositions."""

from __future__ import annotations

from collections.abc import Collection, Iterator

from alight.errors import UnknownName
from alight.theory.falsification import (
    approach,
    contact,
    estimates,
    local,
    robot,
    runs,
    theorem,
)
from alight.theory.falsification.attempt import Attempt
from alight.theory.falsification.claims import Claims
from alight.theory.falsification.hunt import Effort, Search

CLAIMED = Claims()
PARTS = {
    robot: {"A"},
    contact: {"B"},
    approach: {"C", "D", "filter"},
    runs: {"C"},
    local: {"LOC"},
    estimates: {"projection"},
    theorem: {"(23)", "(49)", "(71)"},
}
"""What each part attacks."""
PROPOSITIONS = ("A", "B", "C", "D", "LOC", "filter", "projection", "(23)", "(49)", "(71)", "3.1")
"""What can be attacked: the propositions, the conditions, and inequalities of the paper's proof."""


def falsify(
    seed: int = 0,
    effort: Effort = "quick",
    only: Collection[str] = PROPOSITIONS,
    claims: Claims = CLAIMED,
) -> list[Attempt]:
    """Try to break each claim; the same attempts for the same seed.

    Parameters
    ----------
    seed : int
        Seed of every search.
    effort : {"quick", "full"}
        Some 20 seconds or some three minutes of one core for all of them.
    only : collection of str
        Propositions to attack, of `PROPOSITIONS`.
    claims : Claims
        What is claimed; the project's own functions unless others are given.

    Raises
    ------
    UnknownName
        If there is no such proposition.
    """
    for name in only:
        if name not in PROPOSITIONS:
            raise UnknownName("proposition", name, PROPOSITIONS)
    wanted = (search for search in _searches(claims, only) if search.proposition in only)
    found = [search.run(seed, effort) for search in wanted]
    return found + (list(theorem.joint(claims, seed, effort)) if "3.1" in only else [])


def _searches(claims: Claims, only: Collection[str]) -> Iterator[Search]:
    """Every search of the parts that attack some of the propositions."""
    for part, attacked in PARTS.items():
        if not attacked.isdisjoint(only):
            yield from part.searches(claims)
