"""From a ``[law]`` table to a law."""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Mapping
from typing import Any

from pydantic.dataclasses import is_pydantic_dataclass

from alight.control import ExactModel, ForceLimiting, Law, Target, Unsaturated
from alight.control.transition import ContactTransitionLaw
from alight.errors import AlightError, InvalidParameters, UnknownName
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
        raise AlightError(
            f"cannot be imported: {error}; its module must be installed, or stand in the current "
            "folder or in one of PYTHONPATH"
        ) from None
    if not (isinstance(found, type) and issubclass(found, Law)):
        raise AlightError(f"{name} is not a subclass of alight.Law")
    return found


def make_law(table: Mapping[str, Any], plant: Plant, target: Target) -> Law:
    """Make the law of a scenario; what it is told of the plant is the plant itself."""
    if "type" not in table:
        problem = f"type: missing; one of: {', '.join(LAWS)}, package.module:Class"
        raise InvalidParameters("law", [problem])
    settings = {key: value for key, value in table.items() if key != "type"}
    return law_from(law_class(table["type"]), settings, plant, target)


def share_settings(one: object, other: object) -> bool:
    """Whether two laws read the same ``[law]`` table: that of the paper's error system."""
    try:
        return all(issubclass(law_class(name), ContactTransitionLaw) for name in (one, other))
    except AlightError:
        return True  # it is refused when the law is made, where its place is known


def law_from(cls: type[Any], settings: Mapping[str, Any], plant: Plant, target: Target) -> Law:
    """Make a law of a class with the settings of a ``[law]`` table.

    Raises
    ------
    InvalidParameters
        If a setting is refused.
    AlightError
        If the class is no law, is abstract, or takes other settings.
    """
    if not issubclass(cls, Law):
        raise AlightError(f"{cls.__name__} is not a subclass of alight.Law")
    if inspect.isabstract(cls):
        missing = ", ".join(sorted(cls.__abstractmethods__))
        raise AlightError(f"{cls.__name__} does not say what its {missing} is")
    if not issubclass(cls, ContactTransitionLaw):
        return _other_law(cls, settings)
    if taken := sorted({"model", "target"} & set(settings)):
        problems = [f"{key}: is that of the scenario; remove it" for key in taken]
        raise InvalidParameters(cls.__name__, problems)
    if issubclass(cls, ExactModel):
        settings = {k: v for k, v in settings.items() if k not in ADAPTIVE_KEYS}
    law: Law = cls(model=plant, target=target, **settings)
    return law


def _other_law(cls: type[Law], settings: Mapping[str, Any]) -> Law:
    if not is_pydantic_dataclass(cls):  # one that is says itself what it refuses
        try:
            inspect.signature(cls).bind(**settings)
        except TypeError as error:
            raise AlightError(f"{cls.__name__} cannot be made: {error}") from None
    return cls(**settings)
