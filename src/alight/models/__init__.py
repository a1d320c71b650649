"""Physics, (1)-(8): arm, body, contact law, friction, and the plant that joins them."""

from alight.models.arm import Arm, TwoLinkArm
from alight.models.body import MassSpring
from alight.models.contact import ContactLaw, HuntCrossley, KelvinVoigt, LinearSpring
from alight.models.plant import Plant, PlantState
from alight.models.tip_friction import TipFriction

__all__ = [
    "Arm",
    "ContactLaw",
    "HuntCrossley",
    "KelvinVoigt",
    "LinearSpring",
    "MassSpring",
    "Plant",
    "PlantState",
    "TipFriction",
    "TwoLinkArm",
]
