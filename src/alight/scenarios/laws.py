"""From a ``[law]`` table to a law."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from typing import Any

from alight.control import ExactModel, ForceLimiting, Law, Target, Unsaturated
from alight.control.transition import ContactTransitionLaw
from alight.errors import AlightError, UnknownName
from alight.models import Plant

LAWS: dict[str, type[ContactTransitionLaw]] = {
    "force-limiting": ForceLimiting,
    "unsaturated": Unsaturated,
    "exact-model": ExactModel,
}
"""The laws that ship with Alight, by the name that a scenario uses."""

ADAPTIVE_KEYS = ("Gamma_r", "theta_dk", "theta_r")
"""Keys of an adaptive law that a law with a known model does not read."""


def law_class(name: object) -> type[Any]:
    """Class of a law by its name, or by ``package.module:Class`` for a law of one's own.

    Raises
    ------
    UnknownName
        If there is no such law.
    AlightError
        If the module does not import or holds no such law.
    """
    if isinstance(name, str) and name in LAWS:
        return LAWS[name]
    module, colon, attribute = str(name).partition(":")
    if not colon:
        raise UnknownName("law", name, (*LAWS, "package.module:Class"))
    try:
        found = getattr(importlib.import_module(module), attribute)
    except (ImportError, AttributeError, ValueError) as error:
        raise AlightError(f"law {name!r} cannot be imported: {error}") from None
    if not (isinstance(found, type) and issubclass(found, Law)):
        raise AlightError(f"law {name!r} is not a subclass of alight.Law")
    return found


def make_law(table: Mapping[str, Any], plant: Plant, target: Target) -> Law:
    """Make the law of a scenario; what it is told of the plant is the plant itself."""
    settings = {key: value for key, value in table.items() if key != "type"}
    return law_from(law_class(table.get("type")), settings, plant, target)


def law_from(
    cls: type[Any], settings: Mapping[str, Any], plant: Plant, target: Target
) -> Law:
    """Make a law of a class with the settings of a ``[law]`` table."""
    if not issubclass(cls, ContactTransitionLaw):
        made = cls(**settings)
        return made if isinstance(made, Law) else _refuse(cls)
    if issubclass(cls, ExactModel):
        settings = {k: v for k, v in settings.items() if k not in ADAPTIVE_KEYS}
    law: Law = cls(model=plant, target=target, **settings)
    return law


def _refuse(cls: type[Any]) -> Law:
    raise AlightError(f"{cls.__name__} is not a law")
