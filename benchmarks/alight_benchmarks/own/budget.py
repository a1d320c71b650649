"""What is promised, and whether it holds."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from typing import Any

from alight_benchmarks.own.problems import FULL

Results = Mapping[str, Any]
"""What `alight_benchmarks.own.bench.measure` returns, or some of it."""

TIMES_AHEAD = {
    "jax": ("JAX vmap, batch", 40),
    "scipy": ("SciPy LSODA, C", 100),
    "numba": ("Numba", 200),
    "drake": ("Drake, one system in C", 280),
    "mujoco": ("MuJoCo Euler, law in C", 390),
    "numpy": ("NumPy", 9000),
}
"""How many times as long as a run in a batch of Alight each peer was expected to take."""


@dataclass(frozen=True)
class Line:
    """A figure with its limit."""

    what: str
    figure: float
    limit: float
    unit: str
    at_least: bool = False

    @property
    def holds(self) -> bool:
        """Whether the figure keeps to the limit."""
        return self.figure >= self.limit if self.at_least else self.figure <= self.limit


RUNS = {
    "c": "one run, compiled to the bits of the virtual machine",
    "lanes": "one run, compiled as a batch is",
    "vm": "one run without a compiler",
}


def budget(sections: Results) -> list[dict[str, Any]]:
    """Every line for which the measured sections give a figure, as plain data."""
    return [{**asdict(line), "holds": line.holds} for line in _lines(sections)]


def _lines(sections: Results) -> Iterator[Line]:
    makers = {
        "runs": _runs,
        "batch": _batch,
        "accuracy": _accuracy,
        "threads": _threads,
        "law": _law,
        "costs": _costs,
    }
    for name, maker in makers.items():
        if name in sections:
            yield from maker(sections[name])
    if {"peers", "batch"} <= set(sections):
        yield from _ahead(sections["peers"], sections["batch"])


def _runs(section: Results) -> Iterator[Line]:
    for row in section["rows"]:
        limit = 5.0 if row["backend"] == "vm" else 1.2
        told = f"{RUNS[row['backend']]}: {row['scenario']}, recording {row['channels']}"
        yield Line(told, row["ratio"]["median"], limit, row["unit"])


def _batch(section: Results) -> Iterator[Line]:
    for row in _largest(section):
        told = f"batch of {row['runs']:,} on one core, a run: {row['scenario']}"
        yield Line(told, row["ratio"]["median"], 0.05, row["unit"])


def _largest(section: Results) -> list[Results]:
    most = max(row["runs"] for row in section["rows"])
    return [row for row in section["rows"] if row["runs"] == most]


def _accuracy(section: Results) -> Iterator[Line]:
    for name in dict.fromkeys(row["scenario"] for row in section["rows"]):
        of = [row for row in section["rows"] if row["scenario"] == name and row["usual"]]
        own, plain = (next(r["error"] for r in of if r["located"] is how) for how in (True, False))
        known = [c for c in own if own[c] is not None and plain[c] is not None]
        worst = max(own[channel] / plain[channel] for channel in known)
        yield Line(f"error of the default over that of four plain steps: {name}", worst, 1.0, "")


def _threads(section: Results) -> Iterator[Line]:
    for row in section["rows"]:
        if row["threads"] == 2:
            yield Line("rate of two threads over one", row["rate"]["median"], 1.9, "", True)


def _law(section: Results) -> Iterator[Line]:
    row = section["rows"][0]
    yield Line("one law tick from Python over C in C", row["ratio"]["median"], 1.6, "")


def _costs(section: Results) -> Iterator[Line]:
    yield Line("import alight", section["import_alight"], 0.5, "s")


def _ahead(peers: Results, batch: Results) -> Iterator[Line]:
    own = next(r for r in _largest(batch) if r["scenario"] != FULL)["ratio"]["median"]
    by_name = {row["name"]: row for row in peers["rows"] if row.get("same")}
    for name, limit in TIMES_AHEAD.values():
        if name in by_name:
            times = by_name[name]["ratio"]["median"] / own
            yield Line(f"time of {name} over a run in a batch of Alight", times, limit, "", True)
