"""What is said of a force before it acts: a number, what it bounds, and how far it is proven."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Standing = Literal["identity", "proven", "proven on the model (1)-(8)", "heuristic"]

FAR = 10.0
"""A bound this many times above what a run shows is called vacuous."""


@dataclass(frozen=True)
class Bound:
    """A bound in numbers, beside what one run shows of the same quantity."""

    name: str
    statement: str
    """The inequality or equality in symbols."""
    unit: str
    proven: Standing
    """``"identity"`` holds whatever the plant; ``"proven"`` needs what ``meaning`` says; the model
    (1)-(8) has no friction, no damping, no sampling and no motor limits."""
    meaning: str
    """One sentence: what it is for, and what it assumes."""
    value: float | None = None
    """No larger magnitude is possible; None if that is undefined."""
    lower: float | None = None
    """Lower end, where the statement gives an interval; ``value`` is then its upper end."""
    undefined: str = ""
    """Why there is no value; empty if there is one."""
    simulated: float | None = None
    """What the run shows; None if it does not come that far."""
    known: float | None = None
    """What motors or geometry allow anyway; None if they say nothing."""
    because: str = ""
    """Which of them, where ``known`` is given: "the motor"."""

    @property
    def size(self) -> float | None:
        """Largest magnitude that is admitted."""
        if self.value is None:
            return None
        return max(abs(self.value), abs(self.lower or 0.0))

    @property
    def beyond(self) -> bool:
        """Whether the value is more than motors or geometry allow."""
        return None not in (self.size, self.known) and self.size > self.known  # type: ignore[operator]

    @property
    def ratio(self) -> float | None:
        """The bound over what the run shows; None where one of them is missing or zero."""
        if not self.size or not self.simulated:
            return None
        return self.size / abs(self.simulated)

    @property
    def vacuous(self) -> str:
        """Why the bound says next to nothing; empty if it says something."""
        if self.proven == "identity" or self.size is None:
            return ""
        if self.known is not None and self.size >= self.known:
            return f"not below the {self.known:.3g} {self.unit} of {self.because}"
        if self.ratio is not None and self.ratio >= FAR:
            return f"{self.ratio:.3g} times what the run shows"
        return ""
