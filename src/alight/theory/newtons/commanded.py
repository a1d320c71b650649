"""Bounds of what the law commands: feedback, first force and torque, interval of the force."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from alight.control import AdaptiveState
from alight.theory.lyapunov import ideal_measurement
from alight.theory.newtons.bound import Bound, Standing
from alight.theory.newtons.feedback import joint_limit, joint_limit_of_all_poses
from alight.theory.newtons.shown import Shown, peak

ON_MODEL: Standing = "proven on the model (1)-(8)"


def feedback_forces(run: Shown) -> Iterator[Bound]:
    """Per axis: whatever the errors, and for those that Proposition A admits."""
    limit, within = run.limit, run.limit_of_A
    for i in range(2):
        found = peak(run.seen["feedback"][:, i])
        yield Bound(
            name=f"feedback force, axis X{i + 1}",
            statement=f"|F - Y_r theta_r_hat|_{i + 1} <= sup of the feedback",
            unit="N",
            proven="proven",
            meaning="What the feedback adds to the feedforward, whatever errors, plant and sensors "
            "do; 1 + k3 for (32). It says nothing of the feedforward.",
            value=None if limit is None else float(limit[i]),
            undefined="" if limit is not None else "the feedback grows with the errors",
            simulated=found,
        )
        yield Bound(
            name=f"feedback force by Proposition A, axis X{i + 1}",
            statement=f"|F - Y_r theta_r_hat|_{i + 1} <= feedback at the bounds of e_r and r_r",
            unit="N",
            proven=ON_MODEL,
            meaning="The same for the errors that Proposition A admits from this start on.",
            value=float(within[i]),
            simulated=found,
        )


def feedback_torques(run: Shown) -> Iterator[Bound]:
    """Per joint: at the start, worst along the run, worst over all poses."""
    limit, arm = run.limit, run.case.law.model.arm
    force: np.ndarray = run.limit_of_A if limit is None else limit
    proven: Standing = ON_MODEL if limit is None else "proven"
    poses = {
        "in the pose of the start": (joint_limit(run.seen["J_measured"][0], force), slice(1)),
        "in the worst pose of the run": (
            joint_limit(run.seen["J_measured"], force).max(axis=0),
            slice(None),
        ),
        "in every pose": (joint_limit_of_all_poses(arm, force), slice(None)),
    }
    basis = "Proposition A" if limit is None else "the sup of the feedback"
    for where, (value, samples) in poses.items():
        for j in range(2):
            yield Bound(
                name=f"feedback torque {where}, joint {j + 1}",
                statement=f"|tau_feedback|_{j + 1} <= sum_i |J_i{j + 1}| |feedback|_i",
                unit="N m",
                proven=proven,
                meaning=f"Share of the feedback in the joint torque {where}, by {basis}.",
                value=float(value[j]),
                simulated=peak(run.seen["tau_feedback"][samples, j]),
                known=float(run.motor_limit[j]),
                because="the motor",
            )


def first_commands(run: Shown) -> Iterator[Bound]:
    """``F(0)`` and ``tau(0)``, with the first estimates and with exact ones."""
    case, law = run.case, run.case.law
    exact = AdaptiveState(case.a.u_f, case.plant.theta_dk, law.theta_r_of(law.pi_of(case.plant)))
    measured = ideal_measurement(case.s)
    for which, a in (("", case.a), (" with exact estimates", exact)):
        flow = law.flow(a._asdict(), measured)
        for name, unit, values, recorded in (
            ("F", "N", flow.signals["F"], run.seen["F"][0]),
            ("tau", "N m", flow.tau, run.seen["tau"][0]),
        ):
            for i in range(2):
                motor = name == "tau"
                yield Bound(
                    name=f"{name}(0){which}, entry {i + 1}",
                    statement=f"{name}_{i + 1}(0) = its value at the start",
                    unit=unit,
                    proven="identity",
                    meaning="Computed by the law at its first sample: known before the run."
                    if not which
                    else "What the law would compute first if it knew the plant of the scenario.",
                    value=float(values[i]),
                    simulated=None if which else float(recorded[i]),
                    known=float(run.motor_limit[i]) if motor else None,
                    because="the motor" if motor else "",
                )


def force_intervals(run: Shown) -> Iterator[Bound]:
    """Commanded force over the box of ``theta_r``, at the start and worst along the run."""
    lower, upper, J = (run.seen[name] for name in ("F_lower", "F_upper", "J_measured"))
    clipped = joint_limit(np.linalg.inv(J), run.motor_limit)  # F = J^-T tau
    sizes = np.maximum(np.abs(lower), np.abs(upper))
    for i in range(2):
        worst = int(sizes[:, i].argmax())
        for where, k, found in (
            ("at the start", 0, float(run.seen["F"][0, i])),
            (f"worst along the run, at {run.recording.t[worst]:.3g} s", worst, None),
        ):
            yield Bound(
                name=f"force over the projection box {where}, axis X{i + 1}",
                statement=f"F_{i + 1} = (Y_r theta_r_hat + feedback)_{i + 1}, theta_r_hat in its "
                "widened box",
                unit="N",
                proven="proven",
                meaning="All that the law can command in this state, whatever it learns; the "
                "projection and the clip of each step keep the estimates there.",
                value=float(upper[k, i]),
                lower=float(lower[k, i]),
                simulated=peak(run.seen["F"][:, i]) if found is None else found,
                known=float(clipped[k, i]),
                because="the motors in that pose",
            )
