"""The plant that the paper's equations speak of: (1)-(8) without friction and damping."""

from __future__ import annotations

from alight.models import LinearSpring, MassSpring, Plant, TwoLinkArm


def lossless(plant: Plant) -> Plant:
    """Keep the inertias, gravity and stiffnesses of a plant, and leave its dissipation out."""
    arm, body = plant.arm, plant.body
    return Plant(
        TwoLinkArm(arm.l1, arm.l2, arm.p1, arm.p2, arm.p3, arm.plane, arm.g1, arm.g2),
        MassSpring(body.m, body.k_s, body.x_0),
        LinearSpring(K_I=plant.contact.K_I),
    )
