"""What a newcomer installs: locked by hash, from wherever their pip looks, and one version."""

import re
import tomllib
from pathlib import Path

import pytest
import yaml
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

import alight

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
CITATION = yaml.safe_load((ROOT / "CITATION.cff").read_text("utf-8"))
LOCKS = ("runtime", "test", "bench")


def entries(lock: str) -> list[str]:
    """Return each requirement of a lock with its options, on one line."""
    text = (ROOT / "requirements" / f"{lock}.txt").read_text("utf-8")
    return text.replace("\\\n", " ").splitlines()


def locked(lock: str) -> dict[str, Requirement]:
    """Return the requirements of a lock by name, their hashes left out."""
    found = [Requirement(entry.split("--hash=")[0]) for entry in entries(lock)]
    return {canonicalize_name(requirement.name): requirement for requirement in found}


def asked(*extras: str) -> list[Requirement]:
    """Return what pyproject.toml asks for, with these extras, itself left out."""
    lists = [PROJECT["dependencies"], *(PROJECT["optional-dependencies"][e] for e in extras)]
    found = [Requirement(line) for each in lists for line in each]
    return [requirement for requirement in found if requirement.name != PROJECT["name"]]


@pytest.mark.parametrize("lock", LOCKS)
def test_each_line_of_a_lock_pins_one_version_and_holds_its_hashes(lock):
    pinned = re.compile(r"[\w.-]+==[\w.]+ *(;[^-]*)?( +--hash=sha256:[0-9a-f]{64})+")
    assert entries(lock)
    assert [entry for entry in entries(lock) if not pinned.fullmatch(entry)] == []


@pytest.mark.parametrize("lock", LOCKS)
def test_a_lock_names_no_address(lock):
    assert not re.search(r"://|@|index|find-links|trusted-host", "\n".join(entries(lock)))


@pytest.mark.parametrize(
    ("lock", "extras"),
    [
        ("runtime", ["identify", "live", "drives"]),
        ("test", ["identify", "live", "drives", "docs", "test"]),
        ("bench", ["bench"]),
    ],
)
def test_a_lock_satisfies_what_the_project_asks_for(lock, extras):
    pins = locked(lock)
    backend = Requirement((ROOT / "requirements/build.in").read_text("utf-8").splitlines()[-1])
    for requirement in [*asked(*extras), backend]:
        (pin,) = pins[canonicalize_name(requirement.name)].specifier
        assert requirement.specifier.contains(pin.version), requirement


def test_the_test_lock_holds_the_runtime_lock():
    tested = {entry.split()[0]: entry for entry in entries("test")}
    assert [e for e in entries("runtime") if tested.get(e.split()[0]) != e] == []


def test_the_version_agrees_everywhere():
    changelog = (ROOT / "CHANGELOG.md").read_text("utf-8")
    latest = re.search(r"^## \[(\d[^\]]*)\]", changelog, re.MULTILINE)
    assert latest
    assert {alight.__version__, CITATION["version"], latest[1]} == {PROJECT["version"]}


def test_the_licence_agrees_everywhere():
    assert CITATION["license"] == PROJECT["license"] == "BSD-3-Clause"
    assert (ROOT / "LICENSE").read_text("utf-8").startswith("BSD 3-Clause License")


def test_the_preferred_citation_is_the_paper():
    paper = CITATION["preferred-citation"]
    assert [author["family-names"] for author in paper["authors"]] == [
        "Liang",
        "Bhasin",
        "Dupree",
        "Dixon",
    ]
    assert (paper["type"], paper["year"]) == ("article", 2009)
