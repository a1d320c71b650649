"""The claims of the paper, and what the simulation says to each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from alight.reproduction.evidence import Evidence
from alight.studies.measures import Measures
from alight.studies.published import EXPERIMENT_1, EXPERIMENT_2, SteadyState
from alight.theory import alpha2_floor

FACTOR = 2.0
"""A published steady-state error holds when the simulated one lies within this factor of it."""
SHORT = 1e-3
"""Mean error [m] from which a mass counts as left short of the set point."""
NEGLIGIBLE = 0.1
"""Share of an error below which it counts as vanished."""


@dataclass(frozen=True)
class Claim:
    """One claim: what the paper says, what the simulation shows, and whether it holds."""

    number: int
    statement: str
    source: str
    published: str
    simulated: str
    holds: bool
    ratio: float | None = None
    """Simulated over published value, where the paper prints a number."""
    spread: tuple[float, float] | None = None
    """Least and largest ratio under other sensor noise."""
    note: str = ""
    """What a reader must know to judge the claim."""


def claims(evidence: Evidence) -> list[Claim]:
    """Judge every claim by the evidence, in the order of the paper."""
    one, two = evidence.experiment_1, evidence.experiment_2
    return [
        *_errors(1, "Experiment 1", "Section V-A", one, evidence.repeated_1, EXPERIMENT_1),
        *_errors(4, "Experiment 2", "Section V-B", two, evidence.repeated_2, EXPERIMENT_2),
        _no_saturation(evidence),
        _violent(evidence),
        _clipped(evidence),
        _needs_limit(evidence),
        _faster(evidence),
        _mismatch(evidence),
        _friction(evidence),
        _remark_3(evidence),
    ]


def _errors(
    first: int,
    label: str,
    source: str,
    m: Measures,
    repeated: Sequence[Measures],
    published: SteadyState,
) -> list[Claim]:
    found = []
    for i, (name, target) in enumerate(published._asdict().items()):
        ratio = getattr(m, name) / target
        others = [getattr(other, name) / target for other in repeated]
        found.append(
            Claim(
                first + i,
                f"{label}: peak steady-state |{name}|",
                source,
                _length(target),
                _length(getattr(m, name)),
                m.completed and 1 / FACTOR <= ratio <= FACTOR,
                ratio,
                (min(others), max(others)),
            )
        )
    return found


def _no_saturation(evidence: Evidence) -> Claim:
    m, limit = evidence.experiment_1, evidence.motor_limit
    holds = m.completed and m.tau[0] < limit[0] and m.tau[1] < limit[1]
    return Claim(
        7,
        "(32) with (42) needs no artificial saturation: computed torques below the motor limits",
        "Sections V-A, V-C, Fig. 5",
        f"below {_torques(limit)}",
        _torques(m.tau),
        holds,
        note=""
        if holds
        else "(32) saturates its feedback only, and the adaptive part comes on top of it; with the "
        "pose that the residual errors ask for, the elbow motor carries most of the force along X1",
    )


def _violent(evidence: Evidence) -> Claim:
    hard, soft = evidence.unsaturated_42, evidence.experiment_1
    touched = hard.clearance <= 0 < soft.clearance
    return Claim(
        8,
        "(44) with the gains (42) strikes so hard that the probe's plate is touched",
        "Section V-B",
        "touched",
        f"{'touched' if hard.clearance <= 0 else 'not touched'}; "
        f"peak force in the stiff spring {hard.deflection / soft.deflection:.2f} times that of "
        f"(32), whose least clearance is {_length(soft.clearance)}",
        touched,
        note="the force in the stiff spring is what the probe sees; the contact damper's share of "
        "F_m at the instant of touch depends on where the samples fall",
    )


def _clipped(evidence: Evidence) -> Claim:
    found = evidence.clipped_42
    statement = "Clipping that law until the impact is acceptable leaves the mass short"
    if found is None:
        return Claim(
            9,
            statement,
            "Section V-B",
            "short of the set point",
            "no such limit",
            False,
            note="even the smallest limit tried lets the plate touch the probe",
        )
    share, m = found
    limit = evidence.motor_limit
    holds = m.mean_e_m > SHORT
    return Claim(
        9,
        statement,
        "Section V-B",
        "short of the set point",
        f"limit {_torques((share * limit[0], share * limit[1]))}: mean steady-state e_m "
        f"{_length(m.mean_e_m)}, peak {_length(m.e_m)}",
        holds,
        note=""
        if holds
        else "the strike is hardly harder than that of (32), so that a limit just below that of "
        "the motors spares the probe, and far more torque is left than the spring asks for",
    )


def _needs_limit(evidence: Evidence) -> Claim:
    m, limit = evidence.experiment_2, evidence.artificial_limit
    above = m.tau[0] > limit[0] and m.tau[1] > limit[1]
    return Claim(
        10,
        "(44) with its own gains computes torques above its artificial limit, and converges",
        "Section V-B, Fig. 8",
        "above; converges",
        f"computed {_torques(m.tau)} against {_torques(limit)}; steady-state |e_m| "
        f"{_length(m.e_m)}",
        above and m.completed and m.e_m < SHORT,
    )


def _faster(evidence: Evidence) -> Claim:
    one, two, limit = evidence.experiment_1, evidence.experiment_2, evidence.artificial_limit
    below = limit[0] < one.tau[0] and limit[1] < one.tau[1]
    return Claim(
        11,
        "(44) settles faster than (32) although its limit lies below the torques of (32)",
        "Section V-C",
        "faster; limit below",
        f"e_m within 5 % of the travel after {two.settling:.3f} s against {one.settling:.3f} s; "
        f"limit {_torques(limit)} against peaks of {_torques(one.tau)}",
        below and one.completed and two.completed and two.settling < one.settling,
    )


def _mismatch(evidence: Evidence) -> Claim:
    pairs = [(m.mismatch or 0.0, m.e_r1) for m in (evidence.experiment_1, evidence.experiment_2)]
    ratios = [abs(mismatch) / error for mismatch, error in pairs]
    return Claim(
        12,
        "The residual |e_r1| is the mismatch of theta_dk_hat",
        "Section V-A",
        "(theta_dk_hat - theta_dk) Y_d = e_r1",
        "; ".join(
            f"Experiment {i + 1}: {_length(mismatch)} against {_length(error)}"
            for i, (mismatch, error) in enumerate(pairs)
        ),
        all(1 / FACTOR <= ratio <= FACTOR for ratio in ratios),
        ratios[0],
    )


def _friction(evidence: Evidence) -> Claim:
    m, smooth = evidence.experiment_1, evidence.frictionless_1
    return Claim(
        13,
        "The residual |e_r2| is tip friction: it vanishes with friction off",
        "Section V-A",
        "vanishes",
        f"{_length(m.e_r2)} with, {_length(smooth.e_r2)} without tip friction",
        smooth.completed and smooth.e_r2 < NEGLIGIBLE * m.e_r2,
    )


def _remark_3(evidence: Evidence) -> Claim:
    gains = evidence.gains_1
    floor = alpha2_floor(evidence.K_I, gains.alpha[0])
    return Claim(
        14,
        "The gain alpha2 used is far below the sufficient condition (38)",
        "Remark 3",
        "much lower",
        f"alpha2 = {gains.alpha2:g} against at least {floor:.3g} from its first term alone",
        gains.alpha2 < NEGLIGIBLE * floor,
        note="zeta_K_upper is taken at the plant's own K_I, its smallest admissible value",
    )


def _length(value: float) -> str:
    return f"{value * 1e6:.3g} um" if abs(value) < 5e-5 else f"{value * 1e3:.3g} mm"


def _torques(pair: tuple[float, float]) -> str:
    return f"{pair[0]:.3g} / {pair[1]:.3g} N m"
