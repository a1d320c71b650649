"""The claims as a table, a page and a file."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import alight
from alight.files import whole_file
from alight.reproduction.claims import Claim
from alight.scenarios import Scenario

FIGURES = {
    "figure-4.png": "Fig. 4: errors under (32), solid, and under (44), dashed",
    "figure-5.png": "Fig. 5: applied torques under (32)",
    "figure-6.png": "Fig. 6: desired trajectory along X1 under (32)",
    "figure-7.png": "Fig. 7: computed torques under (44)",
    "figure-8.png": "Fig. 8: applied torques under (44), solid, against the computed ones, dashed",
    "plan-view.png": "The strike in plan",
}


def write_claims(path: Path, claims: Sequence[Claim]) -> None:
    """Write the claims as JSON."""
    content = {
        "alight": alight.__version__,
        "held": sum(claim.holds for claim in claims),
        "claims": [dataclasses.asdict(claim) for claim in claims],
    }
    write_text(path, json.dumps(content, indent=2) + "\n")


def write_report(
    path: Path,
    claims: Sequence[Claim],
    scenarios: Sequence[Scenario],
    identification: Mapping[str, Any],
) -> None:
    """Write claims, identification, assumed values and figures as one Markdown page."""
    parts = [
        "# The paper, reproduced",
        _summary(claims),
        "## Claims",
        _claims_table(claims),
        *_notes(claims),
        "## Where the plant comes from",
        _identification(identification),
        "## Values used",
        *(_values(scenario) for scenario in scenarios),
        "## Figures",
        *(f"![{title}]({name})\n\n*{title}*" for name, title in FIGURES.items()),
    ]
    write_text(path, "\n\n".join(parts) + "\n")


def write_text(path: Path, text: str) -> None:
    """Write a text file whole or not at all."""
    with whole_file(path) as file:
        file.write(text.encode("utf-8"))


def _summary(claims: Sequence[Claim]) -> str:
    held = sum(claim.holds for claim in claims)
    missed = ", ".join(str(claim.number) for claim in claims if not claim.holds)
    rest = f" Not holding: {missed}." if missed else ""
    return f"{held} of {len(claims)} claims hold in simulation.{rest}"


def _claims_table(claims: Sequence[Claim]) -> str:
    rows = [
        "| # | claim | source | published | simulated | ratio (other noise) | holds |",
        "|---|---|---|---|---|---|---|",
    ]
    for c in claims:
        ratio = "" if c.ratio is None else f"{c.ratio:.2f}"
        if c.spread is not None:
            ratio += f" ({c.spread[0]:.2f} to {c.spread[1]:.2f})"
        cells = [str(c.number), c.statement, c.source, c.published, c.simulated, ratio]
        rows.append("| " + " | ".join([*cells, "yes" if c.holds else "**no**"]) + " |")
    return (
        "\n".join(rows)
        .replace("|e_", "\\|e_")
        .replace("_r1|", "_r1\\|")
        .replace("_r2|", "_r2\\|")
        .replace("_m|", "_m\\|")
    )


def _notes(claims: Sequence[Claim]) -> list[str]:
    return [f"Claim {c.number}: {c.note}." for c in claims if c.note]


def _identification(identification: Mapping[str, Any]) -> str:
    if not identification:
        return "The plant was not identified by `alight identify`."
    lines = [
        "The paper does not print the plant. `alight identify` searched for one plant for both "
        "experiments; its cost table:",
        "",
        "| term | cost |",
        "|---|---|",
        *(f"| {name} | {value:.3g} |" for name, value in identification["costs"].items()),
        "",
        str(identification["kind"]),
    ]
    return "\n".join(lines)


def _values(scenario: Scenario) -> str:
    rows = [f"### {scenario.title}", "", "| value | source | note |", "|---|---|---|"]
    for path, source in scenario.provenance.items():
        rows.append(f"| `{path}` | {source.kind} | {source.note} |")
    return "\n".join(rows)
