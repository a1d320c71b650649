"""The paper's Figs. 4 to 8, the strike in plan, and the strike as an animation.

Every function draws into a figure or axes of yours if you hand it one, returns the figure, opens
no window and leaves Matplotlib's global settings alone.
"""

from alight.figures.animation import animate
from alight.figures.certificate import lyapunov, stable_region
from alight.figures.error_panels import errors
from alight.figures.files import save
from alight.figures.plan import plan_view
from alight.figures.torque_panels import applied_against_computed, computed_torques, torques
from alight.figures.trajectory import desired_trajectory

__all__ = [
    "animate",
    "applied_against_computed",
    "computed_torques",
    "desired_trajectory",
    "errors",
    "lyapunov",
    "plan_view",
    "save",
    "stable_region",
    "torques",
]
