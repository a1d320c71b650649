"""Importing Alight costs little more than importing what it stands on."""

from __future__ import annotations

import json
import subprocess
import sys

import alight
from tests.cli.command import environment

MEASURE = """
import json, sys, time
before = set(sys.modules)
began = time.process_time()
{code}
took = time.process_time() - began
print(json.dumps([took, sorted(set(sys.modules) - before)]))
"""


def cost(code: str, times: int = 3) -> tuple[float, list[str]]:
    """Least processor time [s] of some imports in a fresh process, and the modules imported.

    Not time by the clock: other processes must not decide.
    """
    found = []
    for _ in range(times):
        command = [sys.executable, "-c", MEASURE.format(code=code)]
        done = subprocess.run(
            command, env=environment(), capture_output=True, text=True, check=True
        )
        found.append(json.loads(done.stdout))
    return min(took for took, _ in found), found[0][1]


def test_import_alight_takes_less_than_half_a_second_and_loads_nothing_heavy():
    took, modules = cost("import alight")
    assert took < 0.5
    assert not {"casadi", "numpy", "scipy", "pydantic"} & set(modules)


def test_everything_public_costs_little_more_than_what_it_stands_on():
    """The foreign modules that it loads, loaded by themselves, are most of it."""
    whole, modules = cost(f"from alight import {', '.join(alight.__all__)}")
    foreign = [name for name in modules if name.split(".")[0] not in ("alight", "__mp_main__")]
    imports = "import importlib\nfor name in {!r}:\n    importlib.import_module(name)"
    names = [name for name in foreign if name in ("casadi", "numpy") or name.startswith("pydantic")]
    names += [name for name in ("scipy.integrate", "tomlkit") if name in foreign]
    alone, _ = cost(imports.format(names))
    print(f"everything public: {whole:.2f} s, its dependencies alone: {alone:.2f} s")
    assert whole < 2 * alone + 0.2


def test_neither_figures_nor_files_nor_the_command_line_are_loaded_before_they_are_used():
    _, modules = cost(f"from alight import {', '.join(alight.__all__)}", times=1)
    assert not {"matplotlib", "pyarrow", "mcap", "typer", "rich", "PIL"} & set(modules)
