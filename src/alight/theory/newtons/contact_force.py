"""Bounds of the contact force: at the end, from the law's signals, from energy, from V_m."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

import numpy as np

from alight.models.contact import ContactLaw
from alight.theory.case import Case
from alight.theory.newtons.bound import Bound
from alight.theory.newtons.commanded import ON_MODEL
from alight.theory.newtons.energy import available, elastic_force
from alight.theory.newtons.shown import Shown, peak
from alight.theory.proven.contact import mass_bounds, mass_obstacle


def final_force(run: Shown) -> Iterator[Bound]:
    """``k_s (x_md - x_0)``, for every admitted spring and for the true one."""
    case, document, recording = run.case, run.scenario.document, run.recording
    body, x_md = case.plant.body, case.law.target.x_md
    ended = recording.verdict.completed
    late = recording.last(document.steady_state)["F_m"]
    ends = final_forces(case)
    shared = {
        "unit": "N",
        "statement": "F_m = k_s (x_md - x_0) at rest",
        "simulated": float(late.mean()) if ended else None,
    }
    yield Bound(
        name="final contact force",
        proven="proven",
        meaning="What holds the mass at its set point, by (6), once it rests there; beside it the "
        "mean over the last part of the run.",
        value=max(ends),
        lower=min(ends),
        **shared,  # type: ignore[arg-type]
    )
    yield Bound(
        name="final contact force with the true spring",
        proven="identity",
        meaning="The same for the spring that is simulated.",
        value=float(body.k_s * body.Y_d(x_md)),
        **shared,  # type: ignore[arg-type]
    )


def final_forces(case: Case) -> tuple[float, float]:
    """Contact force [N] that holds the mass at its set point, for the ends of ``zeta_ks``."""
    softest, stiffest = (float(k_s * case.compression) for k_s in case.bounds.zeta_ks)
    return softest, stiffest


def identity(run: Shown) -> Iterator[Bound]:
    """``F_m = K_I max(0, x_rd1 - e_r1 - x_m)``, at run time from the law's own signals."""
    contact, seen = run.scenario.plant.contact, run.seen
    statement = "F_m = K_I max(0, Y_d theta_dk_hat + k2 tanh(e_m) - k1 k2 u/(1 - u^2) - e_r1)"
    deepest = float(seen["gap_told"].max())
    ends = [_stiff(run, K_I).force(deepest, 0.0) for K_I in run.case.bounds.zeta_K]
    hardens = _hardens(contact)
    yield Bound(
        name="peak contact force from the law's signals",
        statement=statement,
        unit="N",
        proven="proven",
        meaning="Read at run time from signals that the law has, for every K_I within zeta_K; "
        "beside it the peak of the elastic part.",
        value=None if hardens else float(max(ends)),
        lower=None if hardens else float(min(ends)),
        undefined=hardens,
        simulated=peak(seen["F_m_elastic"]),
    )
    for what, of, why in (
        ("the elastic part", "F_m_elastic", "sensors alone"),
        ("the whole contact force", "F_m", "sensors and the contact's damper"),
    ):
        yield Bound(
            name=f"largest deviation of that identity from {what}",
            statement=statement,
            unit="N",
            proven="identity",
            meaning=f"With the true K_I; zero on (7) with perfect sensors, here due to {why}.",
            value=0.0,
            simulated=peak(seen["F_m_told"] - seen[of]),
        )


def _stiff(run: Shown, K_I: float) -> ContactLaw:
    """The contact of the run with another stiffness."""
    return dataclasses.replace(run.scenario.plant.contact, K_I=K_I)


def _hardens(contact: ContactLaw) -> str:
    """Why ``zeta_K`` bounds no force of this contact; empty if it does."""
    linear = np.isclose(contact.force(2.0, 0.0), 2 * contact.force(1.0, 0.0), rtol=1e-9)
    return "" if linear else "zeta_K bounds the stiffness of (7); this contact is not linear"


def energy(run: Shown) -> Iterator[Bound]:
    """``F_m <= sqrt(2 K_I (E(0) + work))`` with the work of the torque that was applied."""
    plant, force = run.scenario.plant, run.seen["F_m_elastic"]
    hardens, stiffest = _hardens(plant.contact), _stiff(run, run.case.bounds.zeta_K[1])
    energy = available(plant, run.recording, run.seen["energy"])
    highest = int(force.argmax())
    inside = force > 0
    slack = elastic_force(plant.contact, energy) - force
    least = f"{slack[inside].min():.3g} N" if inside.any() else "not defined without contact"
    for where, value, contact, why in (
        ("highest along the run", float(energy.max()), stiffest, hardens),
        ("at the peak of the force", float(energy[highest]), plant.contact, ""),
    ):
        yield Bound(
            name=f"elastic contact force from the work of the motors, {where}",
            statement="F_m <= sqrt(2 K_I (E(0) + sum tau . (q_next - q)))",
            unit="N",
            proven="proven",
            meaning=(
                "A monitor from torques and angles; friction and damping only lower it. The force "
                "of a contact's damper comes on top, and what a bristle of tip friction gives back."
                if contact is stiffest
                else f"The same with the true K_I; its least slack in contact is {least}."
            ),
            value=None if why else float(elastic_force(contact, np.array(value))),
            undefined=why,
            simulated=peak(force),
        )


def lasting_contact(run: Shown) -> Iterator[Bound]:
    """Proposition B: the force while contact, once made, is kept."""
    undefined, bounds = mass_obstacle(run.case), mass_bounds(run.case)
    if bounds is not None and bounds.F_m is None:
        undefined = "the bound of V_m lets the filter come closer to 1 than numbers can tell"
    numbers = run.contact
    yield Bound(
        name="contact force in lasting contact, by Proposition B",
        statement="F_m <= K_I (sup (x_rd1 - x_m) + sup |e_r1|) with V_m <= V_m(t_c) + "
        "K_I^2/(4 m margin) int e_r1^2",
        unit="N",
        proven=ON_MODEL,
        meaning="Needs VTX for every admitted mass and stiffness, and contact that is never lost; "
        "beside it the peak from first touch to first separation.",
        value=None if bounds is None else bounds.F_m,
        undefined=undefined,
        simulated=peak(run.seen["F_m_elastic"][numbers]) if numbers.size else None,
    )
