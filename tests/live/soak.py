"""A soak of the live bench on a loaded machine: ``python -m tests.live.soak --minutes 10``.

The whole bench runs an experiment under its supervisor while every core is kept busy, the disk is
written, a browser watches, and gains change every few seconds. Afterwards the recording is held
against what the host says it did.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import multiprocessing
import os
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import psutil

import alight
from alight.files import whole_file
from alight.live.session import Link
from alight.live.shared.commands import Kind, Outcome
from alight.live.shared.status import EDGES, State
from alight.simulation.recording_events import EventKind
from alight.tables import Table, markdown
from tests.live.bench import Bench, ask, supervised, wait_for, with_value
from tests.live.browser import browser

PARTS = ("host", "record", "page")
SETTLED = 0.2
"""Share of the soak after which memory is looked at for the first time."""
EVERY = 5.0
"""Time [s] between two changes of gains."""


def busy(_: int) -> None:
    """Keep a core busy with what fills its caches."""
    numbers = np.random.default_rng(0).standard_normal((600, 600))
    while True:
        numbers = np.tanh(numbers @ numbers / 600)


def writing(folder: str) -> None:
    """Keep the disk busy."""
    block = os.urandom(1 << 20)
    while True:
        with open(Path(folder) / "load", "wb") as file:
            for _ in range(64):
                file.write(block)
            os.fsync(file.fileno())


@contextlib.contextmanager
def load(folder: Path) -> Iterator[int]:
    """Keep every core and the disk busy; says how many processes do so."""
    context = multiprocessing.get_context("spawn")
    jobs = [context.Process(target=busy, args=(i,)) for i in range(os.cpu_count() or 1)]
    jobs.append(context.Process(target=writing, args=(str(folder),)))
    for job in jobs:
        job.start()
    try:
        yield len(jobs)
    finally:
        for job in jobs:
            job.kill()
            job.join()


def soak(folder: Path, seconds: float) -> dict[str, Any]:
    """Run the bench for so long under load, and return what was seen."""
    with supervised(folder, budget=10**9) as bench, browser() as chromium, load(folder) as jobs:
        link = bench.link()
        page = chromium.new_page(viewport={"width": 1280, "height": 800})
        page.goto(bench.url)
        began = ask(link, Kind.START).tick
        seen = _while_it_runs(bench, link, seconds)
        ended = ask(link, Kind.STOP).tick
        status = link.status.copy()
        ask(link, Kind.RESET)
        frames = page.evaluate("document.querySelector('alight-scopes').painter.frames")
        path = wait_for(lambda: _finished(bench))
    recording = alight.Recording.load(path)
    return {
        "seconds": seconds,
        "load": jobs,
        "ticks": ended - began,
        "frames": frames,
        **_kept(recording),
        **_timing(status),
        **seen,
    }


def _while_it_runs(bench: Bench, link: Link, seconds: float) -> dict[str, Any]:
    """Change gains now and then, look at the memory, until the time is over."""
    processes = {part: psutil.Process(bench.pid(part)) for part in PARTS}
    began, changes, first = time.monotonic(), 0, None
    scenario = bench.session.scenario
    while (passed := time.monotonic() - began) < seconds:
        if first is None and passed > SETTLED * seconds:
            first = {part: process.memory_info().rss for part, process in processes.items()}
        changes += 1
        alpha1 = 25.0 + changes % 20
        answer = ask(link, Kind.PARAMETERS, values=with_value(scenario, alpha1=alpha1))
        assert answer.outcome is Outcome.APPLIED, answer.reason
        time.sleep(min(EVERY, seconds / 20))
    last = {part: process.memory_info().rss for part, process in processes.items()}
    assert first is not None
    return {"changes": changes, "memory": {part: (first[part], last[part]) for part in PARTS}}


def _finished(bench: Bench) -> Path | None:
    """The recording, once the recorder has let go of it."""
    recorder = json.loads((bench.session.folder / "recorder.json").read_bytes())
    return next(bench.recordings.glob("*.mcap")) if recorder["state"] == "idle" else None


def _kept(recording: alight.Recording) -> dict[str, Any]:
    """What the recording holds of the run: its samples, and whether one is missing."""
    running = recording["state"] == State.RUNNING
    steps = np.diff(recording.t) * recording.scenario["testbed"]["sample_rate"]
    return {
        "recorded": int(running.sum()),
        "contiguous": bool(np.all(np.rint(steps) == 1)),
        "gains_recorded": sum(event.kind == EventKind.GAINS for event in recording.events),
        "lost": sum(event.kind == EventKind.ROWS_LOST for event in recording.events),
    }


def _timing(status: Any) -> dict[str, Any]:
    """How well the host kept time [s]."""
    found: dict[str, Any] = {"missed": int(status["missed"]), "ticks_in_all": int(status["ticks"])}
    for name in ("late", "busy"):
        counts = status[f"{name}_counts"].astype(float)
        share = np.cumsum(counts) / counts.sum()
        at = {f"{name}_{q}": np.searchsorted(share, q / 100) for q in (50, 99, 99.9)}
        found |= {key: float(EDGES[min(i + 1, len(EDGES) - 1)]) for key, i in at.items()}
        found[f"worst_{name}"] = float(status[f"worst_{name}"])
    found["scheduling"] = status["scheduling"].decode().splitlines()
    return found


def table(found: dict[str, Any]) -> Table:
    """What was seen, for a person."""

    def us(name: str) -> str:
        return f"{found[name] * 1e6:,.0f} µs"

    rows = [
        ("length", f"{found['seconds'] / 60:g} min"),
        ("processes that keep cores and disk busy", str(found["load"])),
        ("processor cores", str(os.cpu_count())),
        ("ticks of the run", f"{found['ticks']:,}"),
        ("samples of it in the recording", f"{found['recorded']:,}"),
        ("no tick missing between two samples", "yes" if found["contiguous"] else "no"),
        ("changes of gains made, and recorded", f"{found['changes']}, {found['gains_recorded']}"),
        ("deadlines missed", f"{found['missed']:,} of {found['ticks_in_all']:,}"),
        ("tick begins late by, median", f"at most {us('late_50')}"),
        ("99 %", f"at most {us('late_99')}"),
        ("99.9 %", f"at most {us('late_99.9')}"),
        ("worst", us("worst_late")),
        ("tick takes, median", f"at most {us('busy_50')}"),
        ("99 %", f"at most {us('busy_99')}"),
        ("worst", us("worst_busy")),
        ("frames drawn by the page a second", f"{found['frames'] / found['seconds']:.1f}"),
    ]
    for part, (first, last) in found["memory"].items():
        rows.append((f"memory of {part}, after a fifth of the time", f"{first / 2**20:.1f} MiB"))
        rows.append((f"memory of {part}, at the end", f"{last / 2**20:.1f} MiB"))
    return Table("Soak", ("", ">"), rows, [f"{line}." for line in found["scheduling"]])


def main() -> None:
    """Run a soak and write its page."""
    given = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    given.add_argument("--minutes", type=float, default=10.0)
    given.add_argument("--out", type=Path, help="Markdown file")
    options = given.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        page = markdown([table(soak(Path(folder), 60 * options.minutes))])
    print(page)
    if options.out is not None:
        with whole_file(options.out) as file:
            file.write(page.encode())


if __name__ == "__main__":
    main()
