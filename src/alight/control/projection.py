"""The sufficiently smooth projection of [48], one parameter at a time, and its sampled form.

The ball form of Cai, de Queiroz and Dawson (IEEE TAC 51(1), 2006) is used per parameter on an
interval: with a diagonal adaptation gain the ball form over all parameters at once would lose the
inequality that the stability proof needs. In continuous time an estimate stays in the interval
widened by ``epsilon`` on both sides (not in the interval itself, as (28) and (34) print); in
discrete time not even that holds, so that each step ends with a clip to the widened interval.
"""

from __future__ import annotations

from typing import Annotated, Any

from alight.symbolic.ops import as_vector, fabs, maximum, minimum, sqrt, where
from alight.symbolic.parameters import Positive, Quantity, parameters


def _values(field: Any) -> Any:
    return as_vector(field) if isinstance(field, tuple) else field


@parameters
class Estimate:
    """Start and bounds of an estimated parameter, or of several of one law."""

    initial: Annotated[float | tuple[float, ...], Quantity("", "estimate at the start")]
    lower: Annotated[float | tuple[float, ...], Quantity("", "lower bound, (28) and (34)")]
    upper: Annotated[float | tuple[float, ...], Quantity("", "upper bound, (28) and (34)")]
    margin: Annotated[
        Positive, Quantity("", "epsilon of [48], as a fraction of half the interval")
    ] = 0.1
    leak: Annotated[
        Positive, Quantity("1/s", "delta of [48], over the square of half the interval")
    ] = 1e-3
    order: Annotated[int, Quantity("", "number of continuous derivatives, n of [48]")] = 1

    def __post_init__(self) -> None:
        fields = [self.initial, self.lower, self.upper]
        sizes = {len(f) if isinstance(f, tuple) else 0 for f in fields}
        if len(sizes) > 1:
            raise ValueError("initial, lower and upper must have the same number of entries")
        if self.order < 1:
            raise ValueError(f"order = {self.order}: must be 1 or more")
        low, high = as_vector(_tuple(self.lower)), as_vector(_tuple(self.upper))
        if (low >= high).any():
            raise ValueError(
                f"lower = {self.lower} must lie below upper = {self.upper}, entry by entry"
            )
        start = as_vector(_tuple(self.initial))
        if (start < low).any() or (start > high).any():
            raise ValueError(
                f"initial = {self.initial} must lie between lower = {self.lower} and "
                f"upper = {self.upper}"
            )

    @property
    def half_width(self) -> Any:
        """Half the interval."""
        return (_values(self.upper) - _values(self.lower)) / 2

    @property
    def epsilon(self) -> Any:
        """Width of the layer in which the projection acts; the estimate never leaves it."""
        return self.margin * self.half_width

    @property
    def widened(self) -> tuple[Any, Any]:
        """The interval in which the estimate stays: the bounds, widened by ``epsilon``."""
        return _values(self.lower) - self.epsilon, _values(self.upper) + self.epsilon

    def project(self, mu: Any, theta: Any) -> Any:
        """Smooth projection of the rate ``mu`` at the estimate ``theta``, elementwise.

        Equals ``mu`` inside the bounds, and points inwards at the border of the widened interval.
        """
        h = self.half_width
        phi = theta - (_values(self.upper) + _values(self.lower)) / 2
        outside = maximum(phi**2 - h**2, 0.0) / (self.epsilon**2 + 2 * self.epsilon * h)
        outward = phi * mu
        leak = (self.leak * h**2) ** 2
        total = sqrt(outward**2 + leak) + fabs(outward)
        # outward + sqrt(outward^2 + leak), without cancellation where outward is negative
        push = where(outward > 0, total, leak / total)
        return mu - outside ** (self.order + 1) * push * phi / (2 * h**2)

    def clip(self, theta: Any) -> Any:
        """Bring an estimate back to the widened interval, elementwise."""
        low, high = self.widened
        return minimum(maximum(theta, low), high)


def _tuple(value: Any) -> tuple[float, ...]:
    return value if isinstance(value, tuple) else (value,)
