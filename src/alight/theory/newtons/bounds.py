"""Every bound in newtons of one scenario, beside one run of it."""

from __future__ import annotations

from alight.scenarios import Scenario
from alight.simulation import Recording
from alight.theory.case import Case
from alight.theory.newtons.bound import Bound
from alight.theory.newtons.commanded import (
    feedback_forces,
    feedback_torques,
    first_commands,
    force_intervals,
)
from alight.theory.newtons.contact_force import energy, final_force, identity, lasting_contact
from alight.theory.newtons.impact import impact, tracking
from alight.theory.newtons.shown import shown

CHAPTERS = (
    feedback_forces,
    feedback_torques,
    first_commands,
    force_intervals,
    final_force,
    identity,
    energy,
    tracking,
    impact,
    lasting_contact,
)


def bounds_in_newtons(case: Case, scenario: Scenario, recording: Recording) -> tuple[Bound, ...]:
    """Bounds of forces, torques and errors, each with what it rests on and what a run shows.

    Parameters
    ----------
    case : Case
        That of ``scenario``: law, assumptions and start.
    scenario : Scenario
        Its plant and testbed were simulated.
    recording : Recording
        A run of it with all signals and every sample.

    Raises
    ------
    AlightError
        If samples are missing from the recording.
    UnknownName
        If signals are missing from it.
    """
    run = shown(case, scenario, recording)
    return tuple(bound for chapter in CHAPTERS for bound in chapter(run))
