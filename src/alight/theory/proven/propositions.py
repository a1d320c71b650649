"""Every proven condition of a case with its numbers, and the constants that they rest on."""

from __future__ import annotations

from alight.theory.case import Case
from alight.theory.condition import Condition, Constant
from alight.theory.proven.contact import mass_bounds, mass_obstacle, vtx_margin
from alight.theory.proven.filter_domain import filter_condition, filter_room
from alight.theory.proven.first_contact import first_contact
from alight.theory.proven.local_stability import loc_adapting_margin, loc_margin
from alight.theory.proven.robot_part import robot_bounds, tracking_conditions


def propositions(case: Case) -> tuple[Condition, ...]:
    """LOC without and with adaptation, VTX, the replacement of (39), the filter's domain."""
    return (*_local(case), _vtx(case), *tracking_conditions(case), filter_condition(case))


def _local(case: Case) -> tuple[Condition, Condition]:
    g, b = case.law.gains, case.bounds
    kappa = b.zeta_K[0] / b.m_u
    plain, adapting = loc_margin(g), loc_adapting_margin(g, kappa, case.compression)
    return (
        Condition(
            number="LOC",
            statement="alpha1 < alpha2 (k1 + 1/k1) + alpha3",
            left=g.alpha1,
            relation="<",
            right=g.alpha1 + plain,
            unit="1/s",
            meaning=(
                "Necessary and sufficient for local stability in contact on the lossless model, "
                "theta_dk_hat at rest, whatever the mass and the stiffnesses."
            ),
        ),
        Condition(
            number="LOC, adapting",
            statement="alpha1 < alpha2 (k1 + 1/k1) + alpha3 + what adaptation adds",
            left=g.alpha1,
            relation="<",
            right=g.alpha1 + adapting,
            unit="1/s",
            meaning=(
                "The same with theta_dk_hat adapting, at the least K_I / m of the assumptions, "
                "which is the worst."
            ),
        ),
    )


def _vtx(case: Case) -> Condition:
    g, b = case.law.gains, case.bounds
    damping = g.alpha2 * g.k1
    return Condition(
        number="VTX",
        statement=(
            "alpha2 k1 > alpha1 + (m_u / (4 k2 zeta_K)) (alpha1 alpha3 + alpha2^2) "
            "(alpha1^3 + alpha2^2 alpha3) / (alpha1 alpha3)"
        ),
        left=damping,
        relation=">",
        right=damping - vtx_margin(g, b.m_u, b.zeta_K[0]),
        unit="1/s",
        meaning=(
            "In permanent contact e_m, e_f and eta_m go to zero from any start, and V_m is "
            "bounded (Proposition B); at the worst mass and contact stiffness. Of the three "
            "vertices that the condition was first stated with, the one at rest always decides."
        ),
    )


def constants(case: Case) -> tuple[Constant, ...]:
    """What Propositions A to C bound, with numbers over the assumptions."""
    return (*_of_tracking(case), *_of_first_contact(case), *_of_contact(case))


def _of_tracking(case: Case) -> tuple[Constant, ...]:
    robot = robot_bounds(case)
    return (
        Constant("R", "A", robot.R, "J", "V_r(0) at most, and V_r(t) ever after."),
        *(
            Constant(f"sup |r_r{i + 1}|", "A", r, "m/s", "Filtered tracking error of the tip.")
            for i, r in enumerate(robot.r_r)
        ),
        *(
            Constant(f"sup |e_r{i + 1}|", "A", e, "m", "Position error of the tip.")
            for i, e in enumerate(robot.e_r)
        ),
        Constant(
            "int e_r1^2", "A", robot.e_r1_squared, "m^2 s", "What drives the mass in contact."
        ),
    )


def _of_first_contact(case: Case) -> tuple[Constant, ...]:
    found = first_contact(case)
    why = found.undefined
    return (
        Constant("u_inf", "C", found.u_inf, "", "Limit of u_f before contact.", why),
        Constant("s_inf", "C", found.s_inf, "m", "Limit of x_rd1 - x_m before contact.", why),
        Constant("t_contact", "C", found.latest, "s", "First contact comes no later.", why),
        Constant(
            "sup |x_m_dot|",
            "filter",
            float(filter_room(case.law.gains, case.compression, 0.0)),
            "m/s",
            "Speed of the mass at x_0 up to which the filter stays in its domain.",
        ),
    )


def _of_contact(case: Case) -> tuple[Constant, ...]:
    found = mass_bounds(case)
    meant = {
        "V_m": ("V_m", "J", "Mass part of V in permanent contact."),
        "e_m": ("sup |e_m|", "m", "Position error of the mass in permanent contact."),
        "e_f": ("sup |e_f|", "", "Filter variable in permanent contact."),
        "eta_m": ("sup |eta_m|", "m/s", "Filtered error of the mass in permanent contact."),
        "F_m": ("sup F_m", "N", "Contact force in permanent contact."),
    }
    made = []
    for name, (symbol, unit, meaning) in meant.items():
        value = None if found is None else getattr(found, name)
        why = "" if value is not None else mass_obstacle(case) or "beyond every number"
        made.append(Constant(symbol, "B", value, unit, meaning, why))
    return tuple(made)
