"""What the derivations page points at exists: tests, functions, equations."""

from __future__ import annotations

import importlib
import re
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
PAGES = sorted((ROOT / "docs").glob("*.md"))
DERIVATIONS = (ROOT / "docs" / "derivations.md").read_text("utf-8")


def named_in(text: str) -> set[tuple[str, str]]:
    """File and name of each test that a text names; the file is empty where it is left out."""
    whole = re.findall(r"`(tests/[\w/]+\.py)(?:::(test_\w+))?`", text)
    alone = re.findall(r"`(test_\w+)`", text)
    return {*whole, *(("", name) for name in alone)}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_test_that_is_named_exists(page):
    missing = []
    for file, name in named_in(page.read_text("utf-8")):
        files = [ROOT / file] if file else list((ROOT / "tests").rglob("test_*.py"))
        texts = [path.read_text("utf-8") for path in files if path.is_file()]
        if not any(f"def {name}(" in text if name else text for text in texts):
            missing.append(f"{file}::{name}")
    assert missing == []


def test_the_derivations_name_many_tests():
    assert len(named_in(DERIVATIONS)) > 60


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_every_function_that_is_named_exists_and_says_what_it_is(page):
    targets = re.findall(r"\{py:\w+\}`[^`]*?((?:~|<)?alight[\w.]*)>?`", page.read_text("utf-8"))
    for target in targets:
        assert find(target.lstrip("~<")).__doc__, target


def find(path: str) -> Any:
    """What a dotted path means, a module first and its attributes then."""
    parts = path.split(".")
    for end in range(len(parts), 0, -1):
        try:
            found: Any = importlib.import_module(".".join(parts[:end]))
        except ModuleNotFoundError:
            continue
        for name in parts[end:]:
            found = getattr(found, name)
        return found
    raise AssertionError(path)


def test_every_equation_has_its_line_in_the_table():
    """(1) to (47)."""
    rows = re.findall(r"^\| (\(\d+\)[^|]*)\|", DERIVATIONS, re.MULTILINE)
    listed: set[int] = set()
    for row in rows:
        for first, last in re.findall(r"\((\d+)\)(?:–\((\d+)\))?", row):
            listed |= set(range(int(first), int(last or first) + 1))
    assert listed >= set(range(1, 48))
    for number in range(1, 5):
        assert f"Property {number} |" in DERIVATIONS
