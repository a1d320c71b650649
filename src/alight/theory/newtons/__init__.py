"""Bounds in newtons: what can be said of forces before a run, and along one."""

from alight.theory.newtons.along import along, lyapunov_along
from alight.theory.newtons.bound import Bound
from alight.theory.newtons.bounds import bounds_in_newtons
from alight.theory.newtons.contact_force import final_forces
from alight.theory.newtons.energy import available, elastic_force
from alight.theory.newtons.feedback import (
    feedback_limit,
    feedback_within,
    joint_limit,
    joint_limit_of_all_poses,
)
from alight.theory.newtons.force_interval import force_interval
from alight.theory.newtons.trace import Trace

__all__ = [
    "Bound",
    "Trace",
    "along",
    "available",
    "bounds_in_newtons",
    "elastic_force",
    "feedback_limit",
    "feedback_within",
    "final_forces",
    "force_interval",
    "joint_limit",
    "joint_limit_of_all_poses",
    "lyapunov_along",
]
