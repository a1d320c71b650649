"""The scenarios that ship with Alight."""

from __future__ import annotations

from importlib import resources
from importlib.resources.abc import Traversable


def _folder() -> Traversable:
    return resources.files("alight.scenarios") / "files"


def shipped_scenarios() -> list[str]:
    """Names of the scenarios that ship with Alight."""
    return sorted(f.name[:-5] for f in _folder().iterdir() if f.name.endswith(".toml"))


def shipped_file(name: str) -> Traversable:
    """File of a shipped scenario."""
    return _folder() / f"{name}.toml"
