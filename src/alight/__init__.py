"""Alight: control of a robot at the moment it touches something.

The names below are the public surface; each is imported when it is first used.
"""

from __future__ import annotations

import importlib
from typing import Any

__version__ = "0.1.0"

_HOME = {
    "alight.models": (
        "HuntCrossley",
        "KelvinVoigt",
        "LinearSpring",
        "MassSpring",
        "Plant",
        "TipFriction",
        "TwoLinkArm",
    ),
    "alight.control": (
        "AdaptiveContactLaw",
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
    ),
    "alight.testbed": ("Encoder", "Motors", "Probe", "Testbed", "Transducer"),
    "alight.simulation": ("Controller", "Outcome", "Recording", "Verdict", "reference"),
    "alight.scenarios": (
        "Batch",
        "Scenario",
        "load_scenario",
        "shipped_scenarios",
        "simulate",
        "simulate_batch",
    ),
    "alight.theory": ("check", "inspect"),
    "alight.errors": ("AlightError",),
}
_MODULE_OF = {name: module for module, names in _HOME.items() for name in names}

__all__ = sorted(_MODULE_OF)


def __getattr__(name: str) -> Any:
    if name not in _MODULE_OF:
        raise AttributeError(f"module 'alight' has no attribute {name!r}")
    return getattr(importlib.import_module(_MODULE_OF[name]), name)


def __dir__() -> list[str]:
    return [*__all__, "__version__"]
