"""What the display must know before the first row: signals, geometry, limits."""

from __future__ import annotations

from typing import Any

import numpy as np

from alight.control.projection import Estimate
from alight.live.page.source import Source
from alight.scenarios import Scenario
from alight.symbolic.ops import as_vector
from alight.symbolic.signals import Layout


def describe(source: Source) -> dict[str, Any]:
    """Everything about a source that stays the same while its rows come, as plain data."""
    scenario, layout = source.scenario, source.layout
    return {
        "mode": source.mode,
        "name": scenario.name,
        "title": scenario.title,
        "dt": source.dt,
        "head": source.head,
        "columns": _columns(layout),
        "geometry": geometry_of(scenario),
        "limits": limits_of(scenario, layout),
        "boxes": boxes_of(scenario, layout),
    }


def _columns(layout: Layout) -> list[dict[str, str]]:
    meanings = [s.meaning for s in layout.signals.values() for _ in range(s.size)]
    rows = zip(layout.columns, layout.units, meanings, strict=True)
    return [{"name": name, "unit": unit, "meaning": meaning} for name, unit, meaning in rows]


def geometry_of(scenario: Scenario) -> dict[str, Any]:
    """What the plan view is drawn from [m]."""
    plant, target, start = scenario.plant, scenario.target, scenario.document.start
    return {
        "l1": plant.arm.l1,
        "l2": plant.arm.l2,
        "x_0": plant.body.x_0,
        "x_md": target.x_md,
        "x_rd2": target.x_rd2,
        "clearance": scenario.testbed.probe.clearance,
        "K_I": plant.contact.K_I,
        "k_s": plant.body.k_s,
        "start": list(start.x_r),
    }


def limits_of(scenario: Scenario, layout: Layout) -> dict[str, dict[str, float | None]]:
    """Lower and upper end of each column that has any: the motors', and those that trip."""
    motors = scenario.testbed.motors
    bound = np.asarray(motors.clip(as_vector((np.inf, np.inf))), dtype=float)
    found: dict[str, dict[str, float | None]] = {}
    for name in ("tau", "torque", "tau_applied"):
        for i, end in enumerate(bound):
            found[f"{name}{i + 1}"] = {"lower": -float(end), "upper": float(end)}
    for name, limit in scenario.document.limits.items():
        for column in _columns_of(layout, name):
            found[column] = {"lower": limit.lower, "upper": limit.upper}
    return {name: ends for name, ends in found.items() if name in layout.columns}


def boxes_of(scenario: Scenario, layout: Layout) -> dict[str, list[float]]:
    """Bounds between which the law holds each estimate, by column."""
    found: dict[str, list[float]] = {}
    for name in ("theta_dk", "theta_r"):
        estimate = getattr(scenario.law, name, None)
        if not isinstance(estimate, Estimate):
            continue
        lower, upper = np.atleast_1d(estimate.lower), np.atleast_1d(estimate.upper)
        for column, low, high in zip(
            _columns_of(layout, f"{name}_hat"), lower, upper, strict=False
        ):
            found[column] = [float(low), float(high)]
    return found


def _columns_of(layout: Layout, name: str) -> list[str]:
    """The columns of a signal, or the column itself."""
    if name in layout.signals:
        rows = layout.slices()[name]
        return list(layout.columns[rows])
    return [name] if name in layout.columns else []
