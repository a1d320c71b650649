"""Figures of a run written down once more, from whole recordings and with NumPy alone."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np


def expected(
    signals: Mapping[str, np.ndarray], *, dt: float, first: int, travel: float
) -> dict[str, np.ndarray]:
    """Every metric whose signals are given, from rows up to, and without, that of a trip.

    ``first`` is the first row of the steady-state part.
    """
    s = {name: np.asarray(v, dtype=float) for name, v in signals.items()}
    late = {name: v[first:] for name, v in s.items()}
    found: dict[str, np.ndarray] = {}
    if "F_m" in s:
        pressed = np.concatenate([[False], s["F_m"] > 0])
        found["peak_F_m"] = np.fmax.reduce(np.append(abs(s["F_m"]), 0.0))
        found["impulse"] = s["F_m"].sum() * dt
        found["separations"] = np.sum(pressed[:-1] & ~pressed[1:])
        if len(late["F_m"]):
            mean = late["F_m"].mean()
            found["chatter"] = late["F_m"].std() / mean if mean else 0.0
        else:
            found["chatter"] = np.nan
    if "tau" in s:
        found["peak_tau"] = np.fmax.reduce(abs(s["tau"]), axis=0, initial=0.0)
        found["rms_tau"] = np.sqrt((s["tau"] ** 2).sum(axis=0) / max(len(s["tau"]), 1))
    if "clipped" in s:
        found["clipping"] = s["clipped"].sum(axis=0) * dt
    if "e_m" in s:
        outside = np.flatnonzero(abs(s["e_m"]) > 0.05 * travel)
        found["settling"] = outside[-1] * dt if len(outside) else 0.0
    for name in ("e_m", "e_r"):
        if name in s:
            none = np.full(s[name].shape[1:], np.nan)
            some = len(late[name]) > 0
            found[f"steady_{name}"] = abs(late[name]).max(axis=0) if some else none
            found[f"mean_{name}"] = late[name].mean(axis=0) if some else none
    if "probe_clearance" in s:
        whole = len(s["probe_clearance"])
        found["least_clearance"] = s["probe_clearance"].min() if whole else np.nan
    return found
