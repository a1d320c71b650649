"""What the searches found, for the documentation."""

from __future__ import annotations

from collections.abc import Sequence

from alight.tables import Table
from alight.tables import markdown as page
from alight.theory.falsification.attempt import Attempt

FEW = 10
"""Coordinates up to which a page shows where the best attempt is."""


def markdown(attempts: Sequence[Attempt]) -> str:
    """A page of the attempts, as Markdown."""
    rows = [
        (
            attempt.proposition,
            attempt.claim,
            f"{attempt.tries:,}",
            f"{attempt.best:.1e}",
            "BROKEN" if attempt.broken else "not broken",
        )
        for attempt in attempts
    ]
    broken = [_broken(attempt) for attempt in attempts if attempt.broken]
    return page(
        [
            Table(
                title="Attempts to break each proposition",
                columns=("", "claim", ">tries", ">best attempt", "verdict"),
                rows=rows,
                notes=(*NOTES, *broken),
            )
        ]
    )


NOTES = (
    "A best attempt is the largest violation that was found, relative to the size of the terms "
    "that it is made of, less what rounding can explain: above 0 the claim would be broken. A "
    "value just below 0 means that the claim is met with equality, to rounding: it cannot be "
    "sharpened there. An attempt of a search is random sampling over many decades of every gain, "
    "plant and state, differential evolution from the best of these, and Nelder-Mead.",
    "The same searches find the violation where a claim is falsified on purpose: "
    "`tests/theory/falsification`.",
)


def _broken(attempt: Attempt) -> str:
    where = ", ".join(f"{name} = {value:.6g}" for name, value in attempt.at.items())
    return f"**Broken**: {attempt.claim}, at {where}."
