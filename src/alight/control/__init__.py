"""Laws (16)-(36) and (44): error system, desired trajectory, projection, adaptation."""

from alight.control.adaptive import AdaptiveContactLaw, AdaptiveState
from alight.control.exact_model import ExactModel
from alight.control.force_limiting import ForceLimiting
from alight.control.gains import Gains, Target
from alight.control.law import Law, PlainLaw, Tick
from alight.control.measurement import Measurement
from alight.control.projection import Estimate
from alight.control.transition import ContactTransitionLaw
from alight.control.unsaturated import Unsaturated

__all__ = [
    "AdaptiveContactLaw",
    "AdaptiveState",
    "ContactTransitionLaw",
    "Estimate",
    "ExactModel",
    "ForceLimiting",
    "Gains",
    "Law",
    "Measurement",
    "PlainLaw",
    "Target",
    "Tick",
    "Unsaturated",
]
