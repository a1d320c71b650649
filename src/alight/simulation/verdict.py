"""How a run ended, and why."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Outcome(Enum):
    """How a run ended; the text says what to do about it."""

    COMPLETED = "ran to its end"
    TRIPPED = "the law left its domain; use smaller gains, or a start nearer to the target"
    DIVERGED = "the loop is unstable with these gains and this plant; see condition LOC"
    STOPPED = "ended by hand; nothing failed"
    HALTED = "the bench took the torques away; see the reason, and reset when it is mended"
    CUT_OFF = "the recording ends early; what it holds is whole"
    NOT_FINITE = "a signal is no longer a number; see whether the arm passed a singular pose"


@dataclass(frozen=True)
class Verdict:
    """Outcome of a run: when it ended, which signal ended it, and the likely cause."""

    outcome: Outcome
    time: float
    """Time of the last recorded sample [s]."""
    signal: str | None = None
    """The signal that ended the run."""
    cause: str | None = None

    @property
    def completed(self) -> bool:
        """Whether the run reached its end."""
        return self.outcome is Outcome.COMPLETED

    def __str__(self) -> str:
        if self.completed:
            return f"ran to its end at {self.time:.4g} s"
        by = "" if self.signal is None else f" by {self.signal}"
        return f"ended at {self.time:.4g} s{by}: {self.cause}; {self.outcome.value}"
