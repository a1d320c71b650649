"""A host that nobody looks after goes on while it is of use, and ends when it is not."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from alight.live.host import orphan
from alight.live.host.orphan import Orphan

ENDED = subprocess.run(
    [sys.executable, "-c", "import os; print(os.getpid())"],
    capture_output=True,
    text=True,
    check=True,
)
NOBODY = int(ENDED.stdout)


@pytest.fixture
def alone(tmp_path, monkeypatch):
    """A host whose supervisor is gone."""
    made = Orphan(tmp_path)
    monkeypatch.setattr(made, "_parent", NOBODY)
    return made


def test_with_its_supervisor_a_host_never_ends_by_itself(tmp_path, monkeypatch):
    monkeypatch.setattr(orphan, "PATIENCE", -1.0)
    assert not Orphan(tmp_path)(running=False)


def test_it_goes_on_while_a_run_is_on_or_a_page_lives(alone, tmp_path, monkeypatch):
    monkeypatch.setattr(orphan, "PATIENCE", -1.0)
    assert not alone(running=True)
    (tmp_path / "page.pid").write_text(str(os.getpid()))
    assert not alone(running=False)
    (tmp_path / "page.pid").write_text(str(NOBODY))
    assert alone(running=False)


def test_it_waits_for_a_while_before_it_ends(alone):
    assert not alone(running=False)
    alone._alone_since -= orphan.PATIENCE
    assert alone(running=False)


@pytest.mark.parametrize("content", ["", "none", "-", "99999999999"])
def test_what_is_no_process_is_no_page(alone, tmp_path, monkeypatch, content):
    monkeypatch.setattr(orphan, "PATIENCE", -1.0)
    (tmp_path / "page.pid").write_text(content)
    assert alone(running=False)
