"""What can be proven of the closed loop instead of Theorem 1: Propositions A-D, LOC and VTX."""

from alight.theory.proven.contact import (
    MassBounds,
    Q,
    mass_bounds,
    mass_bounds_of,
    mass_obstacle,
    schur_margin,
    vtx_margin,
)
from alight.theory.proven.filter_domain import filter_condition, filter_room
from alight.theory.proven.first_contact import FirstContact, first_contact, first_contact_of, lead
from alight.theory.proven.from_lyapunov import contact_from_V, swing_floor
from alight.theory.proven.local_stability import (
    LocalStability,
    linearise,
    loc_adapting_margin,
    loc_margin,
)
from alight.theory.proven.nearest import nearest_vtx, nearest_vtx_of
from alight.theory.proven.propositions import constants, propositions
from alight.theory.proven.robot_part import (
    RobotBounds,
    robot_bounds,
    robot_bounds_of,
    tracking_conditions,
)

__all__ = [
    "FirstContact",
    "LocalStability",
    "MassBounds",
    "Q",
    "RobotBounds",
    "constants",
    "contact_from_V",
    "filter_condition",
    "filter_room",
    "first_contact",
    "first_contact_of",
    "lead",
    "linearise",
    "loc_adapting_margin",
    "loc_margin",
    "mass_bounds",
    "mass_bounds_of",
    "mass_obstacle",
    "nearest_vtx",
    "nearest_vtx_of",
    "propositions",
    "robot_bounds",
    "robot_bounds_of",
    "schur_margin",
    "swing_floor",
    "tracking_conditions",
    "vtx_margin",
]
