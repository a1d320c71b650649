"""Certificates that several tests look at, each made once."""

from __future__ import annotations

import functools
from pathlib import Path

from alight.theory import Certificate, check

EXAMPLES = Path(__file__).parents[2] / "examples"


@functools.cache
def certificate(name: str) -> Certificate:
    """Certificate of a shipped scenario, or of a file in ``examples``."""
    return check(EXAMPLES / name if name.endswith(".toml") else name)
