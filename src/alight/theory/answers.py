"""Three questions before a robot may touch something, and what the certificate answers."""

from __future__ import annotations

import numpy as np

from alight.tables import number
from alight.theory.certificate import Certificate
from alight.theory.newtons import Bound

LIMITED = ("feedback force, axis", "feedback torque in every pose")
"""Names of the bounds that limit the feedback."""
QUESTIONS = (
    "Is it stable with these gains?",
    "How hard can it strike?",
    "What am I assuming?",
)


def answers(made: Certificate) -> tuple[str, str, str]:
    """Answer each of `QUESTIONS` in a few sentences."""
    return _stability(made), _force(made), _assumptions(made)


def _stability(made: Certificate) -> str:
    loc, adapting, vtx = (made.condition(name) for name in ("LOC", "LOC, adapting", "VTX"))
    if not loc.holds:
        model = (
            f"Not on the model (1)-(8): LOC fails, {number(loc.left)} < {number(loc.right)} 1/s is "
            "false, so that the set point is unstable whatever the mass and the stiffnesses."
        )
    elif not adapting.holds:
        model = (
            "Not on the model (1)-(8): with theta_dk_hat adapting the set point is unstable at the "
            "least K_I / m of the assumptions."
        )
    elif not vtx.holds:
        model = (
            "Near its set point, on the model (1)-(8): LOC holds. That it comes there from afar is "
            f"not proven: VTX fails, {number(vtx.left)} > {number(vtx.right)} 1/s is false."
        )
    else:
        model = (
            "Yes, on the model (1)-(8): in contact that lasts, mass and tip converge from any "
            "start (Propositions A and B)."
        )
    return f"{model} {_touch(made)} {made.sampled.told}"


def _touch(made: Certificate) -> str:
    latest = next(c for c in made.constants if c.symbol == "t_contact")
    if latest.value is None:
        return f"That the tip touches the body at all is not proven: {latest.undefined}."
    touching = made.recording["Lambda"] > 0
    seen = "the run never touches"
    if touching.any():
        seen = f"the run touches after {float(made.recording.t[int(np.argmax(touching))]):.3g} s"
    within = f"within {number(latest.value)} s"
    return f"On the model it touches the body {within} (Proposition C; {seen})."


def _force(made: Certificate) -> str:
    limits = [b for b in made.newtons if b.name.startswith(LIMITED) and b.size and not b.vacuous]
    told = ", ".join(f"{b.name.rpartition(', ')[2]} {_size(b)}" for b in limits)
    limited = (
        f"The feedback is limited: {told}. The rest of the force, which the estimates command, "
        "is limited by their boxes alone."
        if told
        else "Neither the feedback nor the rest of the force is limited."
    )
    empty = sum(bool(b.vacuous) for b in made.newtons)
    peak, contact = float(made.recording["F_m"].max()), made.scenario.plant.contact
    elastic = float(contact.force(made.recording["gap"].max(), 0.0))
    return (
        f"{limited} The simulated run peaks at {number(peak)} N of contact force, "
        f"{number(elastic)} N in its spring alone; no proof keeps it there. Of "
        f"{len(made.newtons)} bounds {empty} are vacuous."
    )


def _size(bound: Bound) -> str:
    return f"{number(bound.size)} {bound.unit}"


def _assumptions(made: Certificate) -> str:
    broken = [line.what for line in made.assumed if not line.holds]
    if not broken:
        return f"{len(made.assumed)} things, and the scenario keeps to all of them."
    return (
        f"{len(made.assumed)} things. The scenario does not keep to {len(broken)} of them, and "
        f"what is proven does not cover it there: {'; '.join(broken)}."
    )
