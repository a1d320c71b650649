"""Running ``alight`` as a user does: as a process of its own, or quickly within the test's."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

from typer.testing import CliRunner, Result

import alight
from alight.cli import app

EXAMPLES = Path(__file__).parents[2] / "examples"
OWN_ARM = str(EXAMPLES / "own_arm.toml")
"""A scenario that ends well whatever the shipped ones hold."""
SHORT = ("--set", "duration=0.4", "--set", "steady_state=0.05")
"""Long enough for the first contact of `OWN_ARM`."""
TRIPS = ("--set", "law.gains.alpha1=5000")
"""Lets the filter escape within the first samples, long before any contact."""

# -P as for an installed command: the current folder is not among those of modules.
_COMMAND = [sys.executable, "-P", "-c", "from alight.cli import main; main()"]


def environment(**changes: str | None) -> dict[str, str]:
    """The environment of this process with some variables changed, or removed by None."""
    source = str(Path(alight.__file__).parents[1])
    path = os.pathsep.join(filter(None, [source, os.environ.get("PYTHONPATH")]))
    merged = {**os.environ, "PYTHONPATH": path, **changes}
    return {name: value for name, value in merged.items() if value is not None}


def argv(*args: str) -> list[str]:
    """Command line of a process that runs ``alight`` with the given arguments."""
    return [*_COMMAND, *args]


def process(*args: str, **options: Any) -> subprocess.CompletedProcess[str]:
    """Run ``alight`` as a process of its own, to its end."""
    defaults: dict[str, Any] = {"env": environment(), "timeout": 300, "stderr": subprocess.PIPE}
    if "stdout" not in options:
        defaults["stdout"] = subprocess.PIPE
    return subprocess.run(argv(*args), text=True, check=False, **{**defaults, **options})


def invoke(*args: str) -> Result:
    """Run ``alight`` within this process; what is no `SystemExit` is raised here."""
    return CliRunner().invoke(app, args, prog_name="alight", catch_exceptions=False)
