"""The sections of the benchmark, one after the other."""

from __future__ import annotations

import time
from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from functools import cache
from importlib import import_module
from typing import Any, Protocol

from alight.errors import AlightError, UnknownName
from alight_benchmarks.generated import NoCompiler
from alight_benchmarks.own.machine import description, versions
from alight_benchmarks.own.ratios import QUICK, Pace, Work
from alight_benchmarks.peer import Problem
from alight_benchmarks.peers import ALL
from alight_benchmarks.peers.plain_c import REFERENCE

SECTIONS = ("runs", "batch", "law", "threads", "lanes", "costs", "floor", "accuracy", "live")
"""What is measured of Alight itself; a module of this folder each."""
TOOLS = tuple(dict.fromkeys(peer.package for peer in ALL if peer is not REFERENCE))
"""Packages that are compared with."""


class Report(Protocol):
    """Told the share that is done, and what is done now."""

    def __call__(self, share: float, what: str | None = None) -> None:
        """Take the share."""


@dataclass
class Bench:
    """What sections are given."""

    pace: Pace
    tools: tuple[str, ...]
    """Packages to compare with."""
    processors: list[int]
    """That may be used beside the one that all but threads are kept to."""
    report: Report

    @property
    def reference(self) -> Work:
        """The unit of the ratios: ten seconds of the problem in plain C."""
        return reference()

    @property
    def quick(self) -> bool:
        """Whether it shall be over soon."""
        return self.pace is QUICK


@cache
def reference() -> Work:
    """Ten seconds of the problem in plain C, prepared once in a process."""
    problem = Problem.load()
    return Work(REFERENCE.prepare(problem), problem.duration)


def measure(
    only: Collection[str], pace: Pace, processors: list[int], report: Report
) -> dict[str, Any]:
    """Measure the named sections and tools, or all of them, as plain data.

    Raises
    ------
    UnknownName
        If a name is neither a section nor a tool.
    AlightError
        If there is no C compiler: no ratio means anything without the plain C.
    """
    for name in only:
        if name not in (*TOOLS, *SECTIONS):
            raise UnknownName("part of the benchmark", name, (*TOOLS, *SECTIONS))
    tools = tuple(name for name in TOOLS if not only or name in only)
    sections = [name for name in SECTIONS if not only or name in only]
    began = time.perf_counter()
    bench = Bench(pace, tools, processors, report)
    try:
        found: dict[str, Any] = {"machine": description(), "versions": versions(_packages(tools))}
        done = _measured(bench, (["peers"] if tools else []) + sections)
    except NoCompiler as error:
        raise AlightError(f"{error}: every ratio is to plain C, which needs one") from None
    found["minutes"] = (time.perf_counter() - began) / 60
    return {**found, "sections": done}


def _measured(bench: Bench, names: list[str]) -> dict[str, Any]:
    done = {}
    for i, name in enumerate(names):
        part = replace(bench, report=_share_of(bench.report, i, len(names)))
        part.report(0.0, name)
        done[name] = import_module(f"alight_benchmarks.own.{name}").measure(part)
    return done


def _share_of(report: Report, i: int, count: int) -> Callable[..., None]:
    def told(share: float, what: str | None = None) -> None:
        report((i + share) / count, what)

    return told


def _packages(tools: Collection[str]) -> list[str]:
    return list(dict.fromkeys(["alight", "casadi", "numpy", *tools]))
