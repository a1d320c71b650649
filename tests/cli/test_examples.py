"""The scripts in ``examples`` run, and show what they are there to show."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.cli.command import EXAMPLES, OWN_ARM, environment, invoke

SCRIPTS = sorted(path.name for path in EXAMPLES.glob("*.py"))


def output(name: str, folder: Path) -> str:
    """What a script prints, run in a folder that is not its own."""
    done = subprocess.run(
        [sys.executable, str(EXAMPLES / name)],
        env=environment(),
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert list(folder.iterdir()) == []
    return done.stdout


def numbers(text: str) -> list[float]:
    return [float(number) for number in re.findall(r"\d+\.\d+", text)]


def test_own_law_keeps_the_feedback_below_its_bound(tmp_path):
    lines = output("own_law.py", tmp_path).splitlines()
    assert [line.split()[0] for line in lines] == ["ForceLimiting", "Softsign", "Unsaturated"]
    feedback = {line.split()[0]: numbers(line)[1] for line in lines}
    assert max(feedback["ForceLimiting"], feedback["Softsign"]) < 61.0 < feedback["Unsaturated"]
    assert all("ran to its end" in line and numbers(line)[2] < 1.0 for line in lines)


def test_own_arm_strikes_harder_the_farther_it_reaches(tmp_path):
    head, *rows = output("own_arm.py", tmp_path).splitlines()
    assert "peak force [N]" in head
    reach, contact, force, _ = zip(*(numbers(row)[:4] for row in rows), strict=True)
    assert list(reach) == sorted(reach) and list(force) == sorted(force)
    assert list(contact) == sorted(contact, reverse=True)
    for row, peak in zip(rows, force, strict=True):
        assert ("above the limit" in row) == (peak > 30.0)
    assert 0 < sum(peak > 30.0 for peak in force) < len(force)


def test_many_runs_tell_what_the_peak_force_follows(tmp_path):
    first, spread, *rows = output("many_runs.py", tmp_path).splitlines()
    assert first.startswith("1000 of 1000 runs")
    middle, low, high = (numbers(spread)[i] for i in (0, 1, 2))
    assert low < middle < high
    follows = {row.split(":")[0].rpartition(" ")[2]: float(row.rpartition(" ")[2]) for row in rows}
    assert follows["plant.arm.p1"] > follows["plant.contact.K_I"] > 0.2 > follows["plant.body.k_s"]


def test_a_law_in_ordinary_python_brings_the_body_to_its_set_point(tmp_path):
    text = output("plain_python_law.py", tmp_path)
    assert "ran to its end" in text
    assert numbers(text.splitlines()[-1])[-1] < 1.0  # mm


def test_the_command_lines_in_the_scripts_work(monkeypatch):
    """Those that an example's text offers, in the folder of the examples."""
    monkeypatch.chdir(EXAMPLES)
    monkeypatch.syspath_prepend(EXAMPLES)
    texts = "".join(path.read_text() for path in EXAMPLES.iterdir() if path.suffix != ".pyc")
    found = re.findall(r"^#? +(alight [^`\n]+)$|`(alight [^`]+)`", texts, re.MULTILINE)
    lines = sorted({" ".join("".join(pair).split()) for pair in found})
    assert len(lines) >= 3
    for line in lines:
        if line.startswith("alight live "):
            continue  # goes on until somebody ends it; tests/live/drives opens its file
        result = invoke(*line.split()[1:])
        assert (result.exit_code, result.stderr) == (0, ""), line


@pytest.mark.parametrize("name", SCRIPTS)
def test_every_script_states_what_it_needs_and_is_tested_here(name):
    text = (EXAMPLES / name).read_text()
    assert text.startswith("# /// script\n") and '"alight"' in text
    assert f'output("{name}"' in Path(__file__).read_text()
    assert Path(OWN_ARM).exists()
