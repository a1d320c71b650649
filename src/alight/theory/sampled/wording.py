"""The sampled loop of a scenario in words and tables."""

from __future__ import annotations

from collections.abc import Sequence

from alight.tables import Table, number
from alight.theory.condition import Constant
from alight.theory.sampled.adaptation import AdaptationSteps
from alight.theory.sampled.loops import AtRate, SampledLoop

OFTEN = 0.1
"""Share of the samples from which on a clip is worth a word."""


def told(T: float, loops: Sequence[SampledLoop], steps: AdaptationSteps) -> str:
    """Whether the loop decays at its sample rate, and what is to blame where it does not."""
    present = [loop for loop in loops if loop.present]
    failing = [loop for loop in present if not loop.stable]
    rate = f"Sampled at {number(1 / T)} Hz the loop"
    if not failing:
        return f"{rate} is locally stable in contact and in free motion."
    if missing := sorted({loop.undefined for loop in failing if loop.undefined}):
        return f"{rate} is not known to be stable: {'; '.join(missing)}."
    where = "; ".join(
        f"{loop.phase}, plant {loop.plant}: {_how(loop.adapting)}" for loop in failing
    )
    return f"{rate} is locally unstable ({where}).{_blame(T, failing, steps)}"


def _blame(T: float, failing: Sequence[SampledLoop], steps: AdaptationSteps) -> str:
    """Which loops would decay without adaptation of theta_r_hat, and what is seen of that."""
    calm = [
        f"{loop.phase}, plant {loop.plant}"
        for loop in failing
        if loop.held is not None and (loop.held.largest or 0.0) > T
    ]
    if not calm:
        return ""
    clipped = [
        f"{name} in {share:.0%}"
        for name, share in zip(steps.columns, steps.clipped, strict=True)
        if share > OFTEN
    ]
    stopped = f"; the clip stops {', '.join(clipped)} of the samples of the run" if clipped else ""
    return (
        f" With theta_r_hat held it is stable at that rate ({'; '.join(calm)}): the adaptation is "
        f"too fast for the samples{stopped}."
    )


def _how(found: AtRate | None) -> str:
    if found is None:
        return ""
    rate = found.undefined or f"it decays from {_rate(found)} Hz on"
    return f"spectral radius {found.now.radius:.4f}, {rate}"


def _rate(found: AtRate) -> str:
    return "-" if found.least_rate is None else number(found.least_rate)


def loops_table(T: float, loops: Sequence[SampledLoop]) -> Table:
    """One row for each phase, plant and delay."""
    columns = (
        "phase",
        "plant",
        "torque",
        ">spectral radius",
        ">least damping",
        ">at rad/s",
        ">decays from Hz",
        ">radius, theta_r_hat held",
        ">from Hz, held",
        "",
    )
    return Table(
        f"The law at {number(1 / T)} Hz", columns, [_row(loop) for loop in loops], _notes(loops)
    )


def _row(loop: SampledLoop) -> tuple[str, ...]:
    torque = "a sample late" if loop.delay else "at once"
    named = (loop.phase, loop.plant, torque + (" *" if loop.present else ""))
    found, held = loop.adapting, loop.held
    if found is None or held is None:
        return (*named, *["-"] * 6, loop.undefined)
    damping, frequency = found.now.least_damped
    return (
        *named,
        f"{found.now.radius:.6f}",
        number(damping),
        number(frequency),
        _rate(found),
        f"{held.now.radius:.6f}",
        _rate(held),
        found.undefined,
    )


def _notes(loops: Sequence[SampledLoop]) -> tuple[str, ...]:
    found = [loop.adapting.now for loop in loops if loop.adapting is not None]
    counts = sorted({spectrum.unexcited for spectrum in found})
    left = f" ({' or '.join(str(count) for count in counts)} of them)" if counts else ""
    return (
        "* as the testbed has it. Linearised at rest and discretised exactly, with backward "
        "differences, at the true parameters; sensors ideal, tip friction off. Estimates that "
        "stand elsewhere make another loop.",
        f"Directions of theta_r_hat that nothing excites{left} have eigenvalues of exactly 1 and "
        "are left out. In free motion the loop is continued past the surface, where alone it has "
        "a rest; the mass, which nothing touches there, is left out.",
    )


def adaptation_table(steps: AdaptationSteps, constants: Sequence[Constant]) -> Table:
    """One row for each estimate: largest step along the run, and how often the clip holds it."""
    rows = [
        (name, number(float(ratio)), f"{clipped:.1%}")
        for name, ratio, clipped in zip(steps.columns, steps.ratio, steps.clipped, strict=True)
    ]
    rounding = "; ".join(
        f"{c.symbol} {number(c.value)} {c.unit}" for c in constants if c.number.endswith("sensors")
    )
    return Table(
        "Adaptation in one sample, along the run",
        ("estimate", ">largest T |mu| / (epsilon / (n + 1))", ">on the clip"),
        rows,
        (
            "Up to 1 the Euler step keeps the estimate in its widened bounds by itself; above, the "
            f"clip does. In {steps.beyond:.1%} of the samples at least one estimate is above.",
            f"In {steps.outrun:.1%} of the samples the Euler step adds to V_r more than the "
            "feedback takes from it in continuous time.",
            f"Rounding of the sensors is a disturbance that no eigenvalue shows: {rounding}.",
        ),
    )
