"""Does a siege of the page reach the loop? ``python -m tests.live.siege --out FILE``."""

from __future__ import annotations

import argparse
import multiprocessing
import tempfile
import time
from pathlib import Path

import numpy as np

from alight.files import whole_file
from alight.live.session import Link
from alight.live.shared.commands import Kind
from alight.tables import Table, markdown
from tests.live.bench import ask, columns, supervised
from tests.live.hostile import besiege, keep_off

ROUNDS = 5
SETTLE = 2.0
"""Time [s] after which a process does what it is meant to."""


def siege(folder: Path, seconds: float) -> dict[str, np.ndarray]:
    """Rows of telemetry of a run, by turns in peace, beside another busy core, and under siege.

    What the siege does to the loop beyond what any work of the machine does is the difference
    between the last two.
    """
    found: dict[str, list[np.ndarray]] = {
        "left alone": [],
        "other core busy": [],
        "under siege": [],
    }
    with supervised(folder, budget=10**9) as bench:
        link = bench.link()
        ask(link, Kind.START)
        core = bench.settings.core
        works = {
            "left alone": (time.sleep, (3600.0,)),
            "other core busy": (busy_elsewhere, (core,)),
            "under siege": (besiege, (bench.settings.port, list(link.layout.columns), core)),
        }
        context = multiprocessing.get_context("spawn")
        for _ in range(ROUNDS):
            for name, (work, args) in works.items():
                process = context.Process(target=work, args=args)
                process.start()
                time.sleep(SETTLE)
                found[name].append(_rows(link, seconds))
                process.kill()
                process.join()
        wanted = [columns(link, name).start for name in ("late", "busy", "missed")]
    return {name: np.vstack(parts)[:, wanted] for name, parts in found.items()}


def busy_elsewhere(core: int | None) -> None:
    """Keep a core busy that is not the host's."""
    keep_off(core)
    while True:
        pass


def _rows(link: Link, seconds: float) -> np.ndarray:
    """What the host does in so many seconds; deadlines missed are counted from the first row."""
    first = link.ring.head
    time.sleep(seconds)
    rows = link.ring.read(first)[1]
    missed = columns(link, "missed").start
    rows[:, missed] -= rows[0, missed]
    return rows


def table(found: dict[str, np.ndarray]) -> Table:
    """The two beside one another."""

    def us(values: np.ndarray, share: float) -> str:
        return f"{np.percentile(values, share) * 1e6:,.0f} µs"

    lines = []
    for what, at, share in (
        ("late, median", 0, 50),
        ("late, 99 %", 0, 99),
        ("late, 99.9 %", 0, 99.9),
        ("late, worst", 0, 100),
        ("tick takes, median", 1, 50),
        ("tick takes, 99 %", 1, 99),
        ("tick takes, worst", 1, 100),
    ):
        lines.append((what, *(us(rows[:, at], share) for rows in found.values())))
    missed = (np.maximum(np.diff(rows[:, 2]), 0).sum() for rows in found.values())
    lines.append(("deadlines missed", *(f"{count:,.0f}" for count in missed)))
    lines.append(("ticks", *(f"{len(rows):,}" for rows in found.values())))
    return Table("The page under siege", ("", *(f">{name}" for name in found)), lines)


def main() -> None:
    """Measure and write the page."""
    given = argparse.ArgumentParser(description=__doc__)
    given.add_argument("--seconds", type=float, default=10.0)
    given.add_argument("--out", type=Path, help="Markdown file")
    options = given.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        page = markdown([table(siege(Path(folder), options.seconds))])
    print(page)
    if options.out is not None:
        with whole_file(options.out) as file:
            file.write(page.encode())


if __name__ == "__main__":
    main()
