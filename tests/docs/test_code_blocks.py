"""Every code block of README and of the site runs, in the order of its page.

The blocks of a page share one namespace and one empty folder, as they do for a reader who types
them in. A block that begins with a file name in a comment (``# bench.toml``) is saved under it. A
console block holds commands only, each behind ``$ ``; those of ``make`` are looked up and not run.
"""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
import tomllib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from markdown_it import MarkdownIt

import alight

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
SHORT = {"run": ["--set", "duration=0.4", "--set", "steady_state=0.1"]}
"""Added to a command, where the last word on a value counts."""


@dataclass(frozen=True)
class Block:
    """One fenced block of a page."""

    page: Path
    line: int
    language: str
    text: str

    def __str__(self) -> str:
        return f"{self.page.name}:{self.line}"

    @property
    def file(self) -> str | None:
        """Name under which the reader is told to save it."""
        named = re.match(r"# ([\w-]+\.(?:py|toml))\n", self.text)
        return named[1] if named else None


def blocks(page: Path) -> Iterator[Block]:
    """All code blocks of a page; the directives of the site are none."""
    for token in MarkdownIt("commonmark").parse(page.read_text("utf-8")):
        if token.type in ("fence", "code_block") and not token.info.startswith("{"):
            line = token.map[0] + 1 if token.map else 0
            yield Block(page, line, token.info.strip() or "no language", token.content)


WITH_CODE = [page for page in PAGES if any(blocks(page))]


def run_python(block: Block, space: dict[str, Any]) -> None:
    code = compile("\n" * block.line + block.text, str(block.page), "exec")
    exec(code, space)


def run_console(block: Block, space: dict[str, Any]) -> None:
    for line in block.text.replace("\\\n", "").splitlines():
        prompt, _, command = line.partition(" ")
        assert prompt == "$", f"{block}: {line!r} is no command"
        program, *args = shlex.split(command)
        assert program in ("alight", "make"), f"{block}: {program} is not run by the tests"
        if program == "make":
            done = call(["make", "--dry-run", *args], cwd=ROOT)
        else:
            start = "from alight.cli import main; main()"
            shortened = args if "--help" in args else [*args, *SHORT.get(args[0], [])]
            done = call([sys.executable, "-c", start, *shortened])
        # 1 says that a scenario is not certified: a result, which the page speaks of
        fine = (0, 1) if args[:1] == ["check"] else (0,)
        assert done.returncode in fine, f"{block}: {command}\n{done.stdout}\n{done.stderr}"


def call(command: list[str], cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    return subprocess.run(command, capture_output=True, text=True, check=False, cwd=cwd)


def load_toml(block: Block, space: dict[str, Any]) -> None:
    assert block.file, f"{block}: say in its first line under which name to save it"
    tomllib.loads(block.text)
    assert alight.load_scenario(block.file).provenance or "extends" in block.text


RUN: dict[str, Callable[[Block, dict[str, Any]], None]] = {
    "python": run_python,
    "console": run_console,
    "toml": load_toml,
}


def run_page(found: list[Block], space: dict[str, Any]) -> None:
    """Run blocks in the current folder."""
    for block in found:
        assert block.language in RUN, f"{block}: a block of {block.language} cannot be run"
        if block.file:
            Path(block.file).write_text(block.text, "utf-8")
        RUN[block.language](block, space)


@pytest.fixture
def space(tmp_path, monkeypatch):
    """The namespace of a module of the page's own, in an empty folder."""
    monkeypatch.chdir(tmp_path)
    module = ModuleType("page")
    monkeypatch.setitem(sys.modules, "page", module)
    return module.__dict__


@pytest.mark.filterwarnings("ignore:runs in CasADi's virtual machine")
@pytest.mark.parametrize("page", WITH_CODE, ids=lambda page: page.stem)
def test_every_block_of_a_page_runs(page, space):
    run_page(list(blocks(page)), space)


def test_the_pages_with_code_are_found():
    found = {page.stem for page in WITH_CODE}
    assert found >= {"README", "index", "start", "tutorial", "derivations", "results"}


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("```python\nassert 1 + 1 == 3\n```", AssertionError),
        ("```python\nfrom alight import nothing\n```", ImportError),
        ("```console\n$ alight run nowhere\n```", "unknown scenario"),
        ("```console\n$ make nothing\n```", "nothing"),
        ("```console\n$ rm -r .\n```", "not run by the tests"),
        ("```console\nan output\n```", "is no command"),
        ("```toml\nduration = 1.0\n```", "under which name"),
        ("```toml\n# a.toml\nduration = 1.0\n```", alight.AlightError),
        ("```rust\nfn main() {}\n```", "cannot be run"),
        ("    an indented block", "cannot be run"),
    ],
)
def test_a_block_that_is_wrong_or_not_run_is_noticed(text, complaint, space, tmp_path):
    page = tmp_path / "page.md"
    page.write_text(text, "utf-8")
    kind, message = (AssertionError, complaint) if isinstance(complaint, str) else (complaint, None)
    with pytest.raises(kind, match=message):
        run_page(list(blocks(page)), space)


def test_an_error_names_page_and_line(space, tmp_path):
    page = tmp_path / "page.md"
    page.write_text("# Title\n\n```python\nx = 1\n\nx / 0\n```\n", "utf-8")
    with pytest.raises(ZeroDivisionError) as caught:
        run_page(list(blocks(page)), space)
    assert (caught.traceback[-1].path, caught.traceback[-1].lineno + 1) == (page, 6)
