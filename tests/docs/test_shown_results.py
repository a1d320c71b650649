"""What README and the page of results show is there, and is what the program finds."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from alight.reproduction import reproduce
from alight.theory import page
from alight.theory.falsification import PROPOSITIONS
from tests.theory.certificates import certificate

ROOT = Path(__file__).parents[2]
SHOWN = ROOT / "docs" / "results" / "claims.md"


@pytest.mark.filterwarnings("ignore:runs in CasADi's virtual machine")
def test_the_verdicts_shown_are_those_of_the_program():
    """If not: ``python docs/make_results.py``."""
    rows = re.findall(r"^\| (\d+) \|.*\| (yes|\*\*no\*\*) \|$", SHOWN.read_text("utf-8"), re.M)
    shown = {int(number): verdict == "yes" for number, verdict in rows}
    assert shown == {claim.number: claim.holds for claim in reproduce().claims}


def verdicts(text: str) -> list[tuple[str, str]]:
    """First cell and verdict of each row of the tables that have one."""
    return re.findall(r"^\| ([^|]+) \|.*\| (yes|NO|undefined)(?: \|.*)? \|$", text, re.M)


def test_the_certificate_shown_is_that_of_the_program():
    """If not: ``python docs/make_results.py``. Numbers are left out: they may differ in a digit."""
    shown = (ROOT / "docs" / "results" / "certificate.md").read_text("utf-8")
    found = verdicts(page(certificate("experiment-1")))
    assert len(found) > 40 and verdicts(shown) == found


def test_every_proposition_was_attacked_and_stands():
    shown = (ROOT / "docs" / "results" / "falsification.md").read_text("utf-8")
    rows = re.findall(r"^\| (\S+) \|.*\| (\S.*) \|$", shown, re.M)[2:]
    assert {name for name, _ in rows} == set(PROPOSITIONS)
    assert {verdict for _, verdict in rows} == {"not broken"}


def test_what_readme_points_at_exists():
    text = (ROOT / "README.md").read_text("utf-8")
    targets = re.findall(r"\]\(([^)#]+)", text)
    assert len(targets) > 10
    assert [target for target in targets if not (ROOT / target).is_file()] == []
