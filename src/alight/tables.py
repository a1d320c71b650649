"""What was found, as tables: for a terminal and for a page alike."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Table:
    """A title, columns (``>name`` is aligned to the right), rows of texts, and notes below."""

    title: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    notes: Sequence[str] = ()


def markdown(tables: Sequence[Table]) -> str:
    """The tables for a page."""
    return "\n\n".join(_page_part(table) for table in tables) + "\n"


def _page_part(table: Table) -> str:
    names = [column.removeprefix(">") for column in table.columns]
    rules = ["---:" if column.startswith(">") else "---" for column in table.columns]
    lines = [_line(names), _line(rules), *(_line(row) for row in table.rows)]
    return "\n\n".join([f"## {table.title}", "\n".join(lines), *table.notes])


def _line(cells: Sequence[str]) -> str:
    escaped = (cell.replace("|", "\\|").replace("<", "&lt;") for cell in cells)
    return "| " + " | ".join(cell.replace("\n", "<br>") for cell in escaped) + " |"


def number(value: float | None) -> str:
    """Three digits, without an exponent where that can be read."""
    if value is None:
        return "none"
    rounded = float(f"{value:.3g}")
    return f"{rounded:,.10g}" if 1e-3 <= abs(rounded) < 1e7 or not rounded else f"{value:.2e}"
