"""Integrals over the samples of a run."""

from __future__ import annotations

import numpy as np


def integral(values: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Integral since the first sample, at each sample, by Simpson's rule."""
    from scipy.integrate import cumulative_simpson  # a third of a second, not paid on import

    return np.asarray(cumulative_simpson(values, x=t, initial=0.0))
