"""Help: there at once, complete, and with examples that work."""

from __future__ import annotations

import json
import re
import shlex
import subprocess
import sys

import pytest
import typer.main

from alight.cli import app
from alight.cli.options import BackendName
from alight.kernels import BACKENDS
from tests.cli.command import environment, invoke

VERBS = sorted(typer.main.get_command(app).commands)  # type: ignore[attr-defined]
SLOW = {"bench", "identify", "live", "replay", "reproduce"}
"""Their examples take minutes, or go on until they are stopped, or need a recording; they are run
by the tests of what they call."""

HEAVY = ("casadi", "numpy", "scipy", "pyarrow", "matplotlib", "mcap", "alight.scenarios")


def loaded_by(*args: str) -> set[str]:
    """Modules that a process has imported when it is done with a command line."""
    code = (
        "import sys, json\n"
        "from alight.cli import main\n"
        "try:\n"
        f"    sys.argv = ['alight', *{list(args)!r}]\n"
        "    main()\n"
        "except SystemExit:\n"
        "    pass\n"
        "print('\\n' + json.dumps(sorted(sys.modules)))\n"
    )
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, env=environment(), capture_output=True, text=True, check=True)
    return set(json.loads(done.stdout.splitlines()[-1]))


@pytest.mark.parametrize("args", [("--help",), ("run", "--help"), ("--version",), ("rum",)])
def test_help_is_there_without_loading_what_commands_need(args):
    modules = loaded_by(*args)
    assert "typer" in modules
    assert not modules & set(HEAVY)


def test_a_command_loads_what_it_needs():
    """The test above can fail."""
    assert {"casadi", "numpy"} <= loaded_by("scenarios", "experiment-1")


def test_import_alight_loads_neither_typer_nor_rich():
    code = "import sys, alight, alight.scenarios; print(*sorted(sys.modules))"
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, env=environment(), capture_output=True, text=True, check=True)
    modules = set(done.stdout.split())
    assert "alight.scenarios" in modules
    assert not modules & {"typer", "rich", "click"}


def test_the_first_help_lists_every_verb():
    assert {"run", "scenarios", "reproduce", "identify"} <= set(VERBS)
    result = invoke("--help")
    assert result.exit_code == 0
    for verb in VERBS:
        assert re.search(rf"\b{verb}\b", result.stdout)
    assert "Example: alight run experiment-1" in result.stdout


def test_no_verb_at_all_shows_the_help():
    assert "Usage: alight" in invoke().output


def example_of(verb: str) -> list[str]:
    """Words of the worked example at the end of a verb's help."""
    result = invoke(verb, "--help")
    assert result.exit_code == 0
    _, found, text = result.stdout.partition("Example:")
    assert found, f"alight {verb} --help has no example"
    words = shlex.split(text)
    assert words[:2] == ["alight", verb]
    return words[1:]


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_has_a_worked_example_whose_options_it_knows(verb):
    """Asking for help at its end parses everything before it."""
    result = invoke(*example_of(verb), "--help")
    assert result.exit_code == 0 and "Usage:" in result.stdout
    known = set(re.findall(r"--[a-z]+", invoke(verb, "--help").stdout.partition("Example:")[0]))
    assert {word for word in example_of(verb) if word.startswith("--")} <= known


@pytest.mark.parametrize("verb", [verb for verb in VERBS if verb not in SLOW])
def test_the_worked_example_works(verb, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = invoke(*example_of(verb))
    # 1 says that the plant which ships does not bear it: a result, and no wrong usage.
    assert result.exit_code in (0, 1) and result.stdout and not result.stderr
    assert (verb == "run") == bool(list(tmp_path.rglob("recording.parquet")))


def test_the_backends_offered_are_those_there_are():
    assert tuple(BackendName) == BACKENDS


@pytest.mark.parametrize(
    ("args", "says"),
    [
        (("jump",), "No such command 'jump'"),
        (("run",), "Missing argument"),
        (("run", "experiment-1", "--spead", "3"), "No such option"),
        (("run", "experiment-1", "--backend", "gpu"), "'--backend'"),
        (("run", "experiment-1", "--seed", "-1"), "'--seed'"),
        (("run", "experiment-1", "--seed", "x"), "'--seed'"),
    ],
)
def test_wrong_usage_ends_with_2_and_says_why(args, says):
    result = invoke(*args)
    assert result.exit_code == 2 and result.stdout == ""
    assert says in " ".join(result.stderr.replace("│", " ").split())
