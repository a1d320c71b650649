"""One tick of the law as called from Python, against the same C in a loop of C."""

from __future__ import annotations

from collections.abc import Callable
from itertools import repeat
from typing import Any

import numpy as np

import alight
from alight_benchmarks.own.bench import Bench
from alight_benchmarks.own.problems import full
from alight_benchmarks.own.ratios import Work, compared


def measure(bench: Bench) -> dict[str, Any]:
    """Time of a tick by each way of calling it, over that of a tick in a loop of C."""
    n = bench.pace.ticks_of_law
    c, vm = (_at_work(alight.Controller(full(), backend=name)) for name in ("c", "vm"))
    floor = Work(lambda: c.stepper.seconds_in_c(n), n)
    few = n // 10
    ways = {
        "step(), compiled": Work(_loop(c.step, n), n),
        "step(), virtual machine": Work(_loop(vm.step, few), few),
        "controller(q, x_m), compiled": Work(_calls(c, few), few),
    }
    rows = []
    for name, work in ways.items():
        bench.report(len(rows) / len(ways), f"law by {name}")
        found = compared(work, floor, bench.pace)
        tick, in_c = found["seconds"]["median"] / work.amount, found["base"]["median"] / n
        rows.append({"way": name, "ratio": found["ratio"], "tick": tick, "in_c": in_c})
    return {"rows": rows, "trip": c.trip + vm.trip}


def _at_work(controller: alight.Controller) -> alight.Controller:
    """In contact, at the set point, as a law is for most of its life."""
    target = controller.loop.law.target
    arm = controller.loop.plant.arm
    controller.reading[:2] = arm.inverse(np.array([target.x_md, target.x_rd2]), "+")
    controller.reading[2] = target.x_md
    return controller


def _loop(step: Callable[[], None], n: int) -> Callable[[], None]:
    def call() -> None:
        for _ in repeat(None, n):
            step()

    return call


def _calls(controller: alight.Controller, n: int) -> Callable[[], None]:
    q, x_m = controller.reading[:2].copy(), float(controller.reading[2])

    def call() -> None:
        for _ in repeat(None, n):
            controller(q, x_m)

    return call
