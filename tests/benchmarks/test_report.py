"""What the benchmark prints is what it measured; and so is what the documentation shows."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from alight.tables import markdown, number
from alight_benchmarks.own.budget import budget
from alight_benchmarks.own.figure import convergence
from alight_benchmarks.own.report import tables

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "benchmarks.md").read_text("utf-8")
KEPT = json.loads((DOCS / "results" / "benchmarks.json").read_text("utf-8"))


def section(name: str, figure: float) -> dict[str, object]:
    """A section of one row."""
    found = {"median": figure, "low": figure, "high": figure, "count": 3}
    if name == "batch":
        row = {"scenario": "problem", "runs": 1000, "ratio": found, "unit": "R"}
    elif name == "law":
        row = {"ratio": found}
    elif name == "threads":
        row = {"threads": 2, "rate": found}
    else:
        row = {"name": "Numba", "ratio": found, "same": True}
    return {"rows": [row]}


BATCH = {"batch": section("batch", 0.04)}


def line(sections: dict[str, object], what: str) -> dict[str, object]:
    (found,) = (row for row in budget(sections) if what in row["what"])
    return found


@pytest.mark.parametrize(
    ("name", "what", "figure", "holds"),
    [
        ("batch", "a run", 0.05, True),
        ("batch", "a run", 0.051, False),
        ("law", "law tick", 1.6, True),
        ("law", "law tick", 1.61, False),
        ("threads", "two threads", 1.9, True),
        ("threads", "two threads", 1.89, False),
    ],
)
def test_a_line_of_the_budget_holds_up_to_its_limit(name, what, figure, holds):
    found = line({name: section(name, figure)}, what)
    assert found["figure"] == figure and found["holds"] is holds


def test_how_far_ahead_of_a_peer_is_the_quotient_of_the_ratios():
    found = line({"peers": section("peers", 10.0), "batch": section("batch", 0.04)}, "Numba")
    assert found["figure"] == pytest.approx(250.0) and found["holds"] is True


def test_a_peer_that_ran_something_else_is_not_compared_with():
    other = section("peers", 10.0)
    other["rows"][0]["same"] = False
    assert not any("Numba" in row["what"] for row in budget({"peers": other, **BATCH}))
    assert line({"peers": section("peers", 10.0), **BATCH}, "Numba")


def test_every_kept_peer_ran_the_problem():
    for row in KEPT["sections"]["peers"]["rows"]:
        assert row.get("same", True), row["name"]


def test_the_figure_shows_every_error():
    figure = convergence(KEPT["sections"]["accuracy"])
    shown = [y for axes in figure.axes for drawn in axes.lines for y in drawn.get_ydata()]
    errors = [e for row in KEPT["sections"]["accuracy"]["rows"] for e in row["error"].values()]
    assert sorted(shown) == sorted(error for error in errors if error)


def test_what_was_not_measured_has_no_line():
    assert budget({}) == []
    assert not any("Numba" in row["what"] for row in budget({"peers": section("peers", 10.0)}))


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0461, "0.0461"),
        (1234.5, "1,230"),
        (474.4, "474"),
        (1.0, "1"),
        (0.0, "0"),
        (1.234e-7, "1.23e-07"),
        (None, "none"),
    ],
)
def test_numbers_have_three_digits(value, text):
    assert number(value) == text


def test_the_page_shows_the_figures_that_are_kept():
    assert (DOCS / "results" / "benchmarks.md").read_text("utf-8") == markdown(tables(KEPT))
    assert "results/benchmarks.md" in PAGE and "results/benchmarks.png" in PAGE


def test_the_kept_figures_are_of_everything_and_taken_in_full():
    assert KEPT["quick"] is False
    titles = {table.title for table in tables(KEPT)}
    assert {"Machine", "Budget", "Accuracy", "Threads", "One tick of the law"} <= titles
    measured = [row for row in KEPT["sections"]["peers"]["rows"] if "ratio" in row]
    assert {row["package"] for row in measured} >= {"numpy", "scipy", "jax", "mujoco", "drake"}


def test_the_kept_budget_follows_from_the_kept_figures():
    assert json.loads(json.dumps(budget(KEPT["sections"]))) == KEPT["budget"]


def test_the_words_of_the_page_quote_no_figure():
    """Figures change with each measurement; words that hold one would be wrong tomorrow."""
    quoted = re.findall(r"\d[\d.,]*\s*(?:R\b|%|times|GFLOP|[mnµ]?s\b|MiB)", PAGE)
    assert quoted == []
