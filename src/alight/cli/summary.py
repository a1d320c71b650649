"""What one run comes to: verdict, contact, torques, steady state."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from rich.table import Table
from rich.text import Text

from alight.cli.output import table
from alight.scenarios import Scenario
from alight.simulation import Recording

STEADY = ("e_r1", "e_r2", "e_m")
UNITS = {
    "time": "s",
    "contact_time": "s",
    "peak_F_m": "N",
    "least_probe_clearance": "m",
    "peak_tau": "N m",
    "peak_tau_applied": "N m",
    "motor_limit": "N m",
    "steady_state": "s",
    **{f"peak_{name}": "m" for name in STEADY},
}


@dataclass(frozen=True)
class Summary:
    """Figures of one run in SI units; None where there is no such figure."""

    recording: Recording
    scenario: Scenario
    seed: int

    @property
    def contact_time(self) -> float | None:
        """Time of the first sample in contact [s]."""
        touching = np.flatnonzero(self.recording["Lambda"] > 0)
        return float(self.recording.t[touching[0]]) if len(touching) else None

    @property
    def motor_limit(self) -> list[float]:
        """Largest torque that reaches the joints [N m]."""
        return [float(v) for v in self.scenario.testbed.motors.clip(np.array([np.inf, np.inf]))]

    @property
    def steady_state(self) -> dict[str, float | None]:
        """Peak errors over the last part of a run that reached its end [m]."""
        if not self.recording.verdict.completed:
            return dict.fromkeys(STEADY)
        end = self.recording.last(self.scenario.document.steady_state)
        return {name: _peak(end[name]) if name in end else None for name in STEADY}

    def as_dict(self) -> dict[str, Any]:
        """The figures as plain data, with their units."""
        run, verdict = self.recording, self.recording.verdict
        return {
            "scenario": self.scenario.name,
            "title": self.scenario.title,
            "law": str(self.scenario.document.law["type"]),
            "seed": self.seed,
            "completed": verdict.completed,
            "verdict": {
                "outcome": verdict.outcome.name.lower(),
                "time": verdict.time,
                "signal": verdict.signal,
                "cause": verdict.cause,
                "text": str(verdict),
            },
            "contact_time": self.contact_time,
            "peak_F_m": _peak(run["F_m"]),
            "least_probe_clearance": _least(run["probe_clearance"]),
            "peak_tau": [_peak(run["tau1"]), _peak(run["tau2"])],
            "peak_tau_applied": [_peak(run["tau_applied1"]), _peak(run["tau_applied2"])],
            "motor_limit": self.motor_limit,
            "steady_state": self.scenario.document.steady_state,
            **{f"peak_{name}": value for name, value in self.steady_state.items()},
            "units": UNITS,
        }

    @property
    def ending(self) -> Text:
        """How the run ended, in words."""
        verdict = self.recording.verdict
        return Text(str(verdict), style="green" if verdict.completed else "bold red")

    def as_table(self) -> Table:
        """The figures for a person to read."""
        run, found = self.recording, self.as_dict()
        rows = table("", ">", ">", title=self.scenario.title)
        rows.show_header = False
        touched = found["contact_time"]
        rows.add_row("first contact", "never" if touched is None else f"{touched:.4f} s")
        rows.add_row("peak contact force", _number(found["peak_F_m"], "N"))
        rows.add_row("least clearance at the probe", _length(found["least_probe_clearance"]))
        rows.add_section()
        rows.add_row("", "motor 1", "motor 2")
        for name, text in (
            ("peak_tau", "peak torque, computed"),
            ("peak_tau_applied", "peak torque, applied"),
            ("motor_limit", "limit of the motors"),
        ):
            rows.add_row(text, *(_number(value, "N m") for value in found[name]))
        rows.add_section()
        last = f"in the last {self.scenario.document.steady_state:g} s"
        for name in STEADY:
            value = found[f"peak_{name}"]
            known = _length(value) if name in run else "not recorded"
            rows.add_row(f"peak |{name}| {last}", known)
        return rows


def _finite(values: np.ndarray) -> np.ndarray:
    return values[np.isfinite(values)]


def _peak(values: np.ndarray) -> float | None:
    finite = _finite(values)
    return float(np.abs(finite).max()) if len(finite) else None


def _least(values: np.ndarray) -> float | None:
    finite = _finite(values)
    return float(finite.min()) if len(finite) else None


def _number(value: float | None, unit: str) -> str:
    return "-" if value is None else f"{value:.4g} {unit}"


def _length(value: float | None) -> str:
    if value is None:
        return "-"
    return f"{value * 1e6:.3g} µm" if abs(value) < 1e-4 else f"{value * 1e3:.4g} mm"
