"""What README and the page of results show is there, and is what the program finds."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from alight.reproduction import reproduce

ROOT = Path(__file__).parents[2]
SHOWN = ROOT / "docs" / "results" / "claims.md"


@pytest.mark.filterwarnings("ignore:runs in CasADi's virtual machine")
def test_the_verdicts_shown_are_those_of_the_program():
    """If not: ``python docs/make_results.py``."""
    rows = re.findall(r"^\| (\d+) \|.*\| (yes|\*\*no\*\*) \|$", SHOWN.read_text("utf-8"), re.M)
    shown = {int(number): verdict == "yes" for number, verdict in rows}
    assert shown == {claim.number: claim.holds for claim in reproduce().claims}


def test_what_readme_points_at_exists():
    text = (ROOT / "README.md").read_text("utf-8")
    targets = re.findall(r"\]\(([^)#]+)", text)
    assert len(targets) > 10
    assert [target for target in targets if not (ROOT / target).is_file()] == []
