"""Limits at which the live bench trips: lower and upper ends of signals."""

from __future__ import annotations

from typing import Annotated

from alight.symbolic.parameters import Quantity, parameters


@parameters
class Limit:
    """Range that a signal must not leave, each entry of a vector alike; one end may be absent."""

    lower: Annotated[float | None, Quantity("", "in the unit of the signal; none if absent")] = None
    upper: Annotated[float | None, Quantity("", "in the unit of the signal; none if absent")] = None

    def __post_init__(self) -> None:
        if self.lower is None and self.upper is None:
            raise ValueError("gives neither lower nor upper")
        if self.lower is not None and self.upper is not None and self.lower >= self.upper:
            raise ValueError(f"lower = {self.lower} is not below upper = {self.upper}")
