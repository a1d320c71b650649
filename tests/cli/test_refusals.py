"""Bad input at the command line: one clear message, exit code 2, no traceback, no files."""

from __future__ import annotations

import os
import re

import pytest
import typer

from alight.cli.guard import guarded
from tests.cli.command import OWN_ARM, SHORT, invoke, process
from tests.scenarios.bad_input import CASES, Bad, each_bad_input


def settings_of(bad: Bad) -> list[str]:
    return [word for setting in bad.settings for word in ("--set", setting)]


@each_bad_input
def test_bad_input_ends_with_2_and_one_message(bad, tmp_path):
    path = bad.write(tmp_path)
    result = invoke("run", str(path), *settings_of(bad), "--out", str(tmp_path / "out"))
    assert result.exit_code == 2
    assert result.stdout == ""
    assert result.stderr.startswith(f"error: {path}:\n")
    for part in bad.says:
        assert part in result.stderr
    assert "Traceback" not in result.stderr
    assert os.listdir(tmp_path) == ["mine.toml"]


@pytest.mark.parametrize("bad", [CASES[0], CASES[-1]], ids=lambda bad: bad.name)
def test_so_does_the_process(bad, tmp_path):
    path = bad.write(tmp_path)
    done = process("run", str(path), *settings_of(bad))
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith(f"error: {path}:\n") and "Traceback" not in done.stderr


@pytest.mark.parametrize("verb", ["run", "scenarios"])
@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("experiment-3", "unknown scenario 'experiment-3'; one of: a path to a .toml file"),
        ("nowhere.toml", "nowhere.toml:\n  cannot be read: No such file"),
        ("", "unknown scenario ''"),
        ("/", "/:\n  cannot be read: Is a directory"),
    ],
)
def test_an_unknown_scenario_ends_with_2(verb, name, says):
    result = invoke(verb, name)
    assert result.exit_code == 2 and result.stdout == ""
    assert says in result.stderr


def test_a_setting_without_an_equals_sign():
    result = invoke("run", OWN_ARM, "--set", "plant.body.m")
    assert result.exit_code == 2
    assert result.stderr == (
        "error: --set 'plant.body.m': must read path=value, as in plant.body.m=2.0\n"
    )


def test_a_run_that_no_memory_can_hold_is_refused():
    """Before anything is computed, and before the machine runs out of it."""
    result = invoke("run", OWN_ARM, "--set", "duration=4.9e5")
    assert (result.exit_code, result.stdout) == (2, "")
    assert re.search(r"9.8e\+08 samples .* needs \d+ GB, .* set a shorter duration", result.stderr)


def test_a_defect_keeps_its_traceback(tmp_path):
    """Whoever writes a law must see where it fails."""
    (tmp_path / "broken_law.py").write_text(
        "import alight\n"
        "class Broken(alight.PlainLaw):\n"
        "    states = {}\n"
        "    def initial_state(self):\n"
        "        return {}\n"
        "    def tick(self, state, measured, dt):\n"
        "        return undefined_name\n"
    )
    out = tmp_path / "out"
    args = ("run", OWN_ARM, *SHORT, "--set", "law.type=broken_law:Broken", "--out", str(out))
    done = process(*args, cwd=tmp_path)
    assert done.returncode == 1 and done.stdout == ""
    for part in ("Traceback", "broken_law.py", "line 7", "undefined_name"):
        assert part in done.stderr
    assert not out.exists()


@pytest.mark.parametrize("defect", [ZeroDivisionError, SystemError, RuntimeError, OSError])
def test_a_defect_of_a_command_is_not_swallowed(defect):
    def command() -> None:
        raise defect

    with pytest.raises(defect):
        guarded(command)()


def test_ctrl_c_is_known_in_the_guise_that_casadi_gives_it():
    """Its functions may end with a SystemError because of the KeyboardInterrupt."""

    def command() -> None:
        raise SystemError("returned a result with an exception set") from KeyboardInterrupt()

    with pytest.raises(typer.Exit) as caught:
        guarded(command)()
    assert caught.value.exit_code == 130
