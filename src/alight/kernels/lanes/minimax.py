"""Coefficients of the polynomials in ``vector_math.h``, found by Remez exchange.

``python -m alight.kernels.lanes.minimax`` recomputes the table between the two marks in that
header and rewrites it. Needs mpmath; nothing that runs imports this module.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib import resources
from itertools import pairwise
from pathlib import Path

from mpmath import mp, mpf

HEADER = "vector_math.h"
TABLE = re.compile(r"(?<=/\* minimax begin \*/\n).*?(?=/\* minimax end \*/)", re.DOTALL)
DIGITS = 60  # differences below cancel down to 1e-30 near the origin
SAMPLES = 20  # of the error between two of its zeros
ROUNDS = 20  # of the exchange; five suffice

Real = Callable[[mpf], mpf]


@dataclass(frozen=True)
class Fit:
    """What a polynomial stands for: a target over an interval.

    The weight makes its errors relative ones of the function; the emphasis says how much they
    count.
    """

    name: str
    meaning: str
    target: Real
    weight: Real
    end: mpf
    terms: int
    start: mpf | int = 0
    emphasis: Real = lambda x: mpf(1)

    def counted(self, x: mpf) -> mpf:
        """What the exchange multiplies errors with."""
        return self.weight(x) * self.emphasis(x)


def fits() -> list[Fit]:
    """The polynomials of the header; z is the square of the reduced argument r."""
    quarter, half_octave, octave = mp.pi / 4, mp.log(2) / 4, mp.log(2) / 2
    sqrt, sin, cos, exp, coth = mp.sqrt, mp.sin, mp.cos, mp.exp, mp.coth
    return [
        Fit(
            "SIN",
            "sin r = r + r z P(z), |r| <= pi/4",
            lambda z: (sin(sqrt(z)) / sqrt(z) - 1) / z,
            lambda z: z * sqrt(z) / sin(sqrt(z)),
            quarter**2,
            6,
            # For small r the rounding of r itself leaves the least room.
            emphasis=lambda z: 1 / sqrt(z),
        ),
        Fit(
            "COS",
            "cos r = 1 - z/2 + z^2 P(z), |r| <= pi/4",
            lambda z: (cos(sqrt(z)) - 1 + z / 2) / z**2,
            lambda z: z**2 / cos(sqrt(z)),
            quarter**2,
            6,
        ),
        Fit(
            "COTH",
            "r coth r = 1 + z P(z), |r| <= (log 2)/4",
            lambda z: (sqrt(z) * coth(sqrt(z)) - 1) / z,
            lambda z: z / (sqrt(z) * coth(sqrt(z))),
            half_octave**2,
            5,
        ),
        Fit(
            "EXP",
            "exp r = 1 + r + r^2 P(r), |r| <= (log 2)/2",
            lambda r: (exp(r) - 1 - r) / r**2,
            lambda r: r**2 / exp(r),
            octave,
            10,
            -octave,
        ),
    ]


def parts(value: mpf, count: int) -> list[float]:
    """Doubles whose sum is ``value``, each the rest of those before it."""
    doubles: list[float] = []
    for _ in range(count):
        doubles.append(float(value))
        value -= mpf(doubles[-1])
    return doubles


def constants() -> dict[str, float]:
    """Numbers of the argument reductions."""
    named = {"TWO_OVER_PI": float(2 / mp.pi), "TWO_OVER_LN2": float(2 / mp.log(2))}
    named["ONE_OVER_LN2"] = float(1 / mp.log(2))
    for name, value, count in (
        ("HALF_PI", mp.pi / 2, 3),
        ("HALF_LN2", mp.log(2) / 2, 2),
        ("LN2", mp.log(2), 2),
    ):
        named.update({f"{name}_{i}": part for i, part in enumerate(parts(value, count))})
    return named


def polynomial(coefficients: list[mpf], x: mpf) -> mpf:
    """Value at ``x``, the constant term first."""
    value = mpf(0)
    for coefficient in reversed(coefficients):
        value = value * x + coefficient
    return value


def levelled(fit: Fit, nodes: list[mpf]) -> list[mpf]:
    """Coefficients whose weighted error alternates with one magnitude over the nodes."""
    rows = [
        [x**power for power in range(fit.terms)] + [(-1) ** i / fit.counted(x)]
        for i, x in enumerate(nodes)
    ]
    solved = mp.lu_solve(mp.matrix(rows), mp.matrix([fit.target(x) for x in nodes]))
    return [solved[i] for i in range(fit.terms)]


def extremes(error: Real, nodes: list[mpf], start: mpf | int, end: mpf) -> list[mpf]:
    """Where ``error`` is largest in magnitude, once per run of one sign."""
    fences = [start, *nodes, end]
    grid = [
        a + (b - a) * i / SAMPLES
        for a, b in pairwise(fences)
        for i in range(SAMPLES)
        if a + (b - a) * i / SAMPLES not in (0, start)
    ] + [end]
    runs: list[list[tuple[mpf, mpf]]] = []
    for x in grid:
        value = error(x)
        if runs and runs[-1][-1][1] * value > 0:
            runs[-1].append((x, value))
        else:
            runs.append([(x, value)])
    return [max(run, key=lambda pair: abs(pair[1]))[0] for run in runs]


def first_nodes(start: mpf | int, end: mpf, count: int) -> list[mpf]:
    """Chebyshev's points, pushed aside lest one meets a zero of a weight in the middle."""
    shares = [(1 - mp.cos(mp.pi * (2 * i + 1) / (2 * count))) / 2 for i in range(count)]
    return [start + (end - start) * share ** mpf("1.1") for share in shares]


def remez(fit: Fit) -> list[mpf]:
    """Coefficients of the best polynomial."""
    count = fit.terms + 1
    nodes = first_nodes(fit.start, fit.end, count)
    for _ in range(ROUNDS):
        coefficients = levelled(fit, nodes)

        def error(x: mpf, c: list[mpf] = coefficients) -> mpf:
            return fit.counted(x) * (polynomial(c, x) - fit.target(x))

        found = extremes(error, nodes, fit.start, fit.end)
        while len(found) > count:
            found.pop(0 if abs(error(found[0])) < abs(error(found[-1])) else -1)
        heights = [abs(error(x)) for x in found]
        if len(found) < count or max(heights) < min(heights) * mpf("1.001"):
            break
        nodes = found
    return coefficients


def rounded(fit: Fit) -> tuple[list[float], mpf]:
    """Coefficients as doubles, each rounded before the ones after it are fitted.

    With the origin inside the interval the refitted error jumps there: no exchange then.
    """
    if fit.start:
        doubles = [float(c) for c in remez(fit)]
        return doubles, greatest_error(fit, doubles)
    doubles = []
    rest = fit
    while rest.terms:
        best = remez(rest)
        doubles.append(float(best[0]))
        rest = without_first(rest, doubles[-1])
    return doubles, greatest_error(fit, doubles)


def without_first(fit: Fit, first: float) -> Fit:
    """What the coefficients after the first have to stand for."""
    target, weight = fit.target, fit.weight
    return replace(
        fit,
        target=lambda x: (target(x) - first) / x,
        weight=lambda x: weight(x) * abs(x),
        terms=fit.terms - 1,
    )


def greatest_error(fit: Fit, coefficients: list[float]) -> mpf:
    """Greatest relative error of the function over a dense grid."""
    exact = [mpf(c) for c in coefficients]
    grid = [fit.start + (fit.end - fit.start) * (2 * i + 1) / 2000 for i in range(1000)]
    return max(abs(fit.weight(x) * (polynomial(exact, x) - fit.target(x))) for x in grid)


def table() -> str:
    """Definitions in C."""
    with mp.workdps(DIGITS):
        lines = [f"#define {name} {value.hex()}" for name, value in constants().items()]
        for fit in fits():
            coefficients, error = rounded(fit)
            lines.append(f"/* {fit.meaning}: 2^{float(mp.log(error, 2)):.1f} */")
            lines += [f"#define {fit.name}_{i} {c.hex()}" for i, c in enumerate(coefficients)]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Print the table and write it into the header."""
    new = table()
    print(new, end="")
    header = Path(str(resources.files("alight.kernels.lanes").joinpath(HEADER)))
    header.write_text(TABLE.sub(lambda _: new, header.read_text("utf-8")), "utf-8")


if __name__ == "__main__":
    main()
