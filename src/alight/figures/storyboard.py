"""Which samples of a recording an animation shows, and how slowly."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from alight.errors import AlightError
from alight.figures.traces import first_contact
from alight.simulation.recording import Recording

FRAME_MS = 40
"""Time for which a frame is shown; players do not honour much shorter ones."""
BEFORE, AFTER, BEYOND = 0.008, 0.06, 1.0
"""Slowest part, before and after the first contact, and end of the film after that [s]."""
SHARES = (0.3, 0.4, 0.3)
"""Shares of the frames: approach, impact, what follows."""


class Storyboard(NamedTuple):
    """Which samples of a recording the frames show."""

    samples: np.ndarray
    """Sample of each frame, ascending."""
    slowdown: np.ndarray
    """How many times slower than in truth the film runs at each frame."""


def storyboard(recording: Recording, frames: int, until: float | None = None) -> Storyboard:
    """Spread frames over a recording, so that the impact runs in slow motion.

    Parameters
    ----------
    recording : Recording
    frames : int
        Number of frames, from 2 to the number of samples shown.
    until : float, optional
        End of the film [s]; by default a second after the first contact, or the recording's end.

    Raises
    ------
    AlightError
        If there are too few or too many frames.
    """
    t, touch = recording.t, first_contact(recording)
    end = t[-1] if touch is None else t[touch] + BEYOND
    end = float(min(t[-1], end if until is None else until))
    last = int(np.searchsorted(t, end))
    if not 2 <= frames <= last + 1:
        raise AlightError(f"frames = {frames}: must be from 2 to {last + 1}, the samples shown")
    edges, shares = np.array([0.0, end]), np.ones(1)
    if touch is not None:
        edges = np.clip([0.0, t[touch] - BEFORE, t[touch] + AFTER, end], 0.0, end)
        shares = _shares(np.diff(edges))
    knots = np.concatenate([[0.0], np.cumsum(shares / shares.sum())])
    times = np.interp(np.linspace(0.0, 1.0, frames), knots, edges)
    slowdown = FRAME_MS / 1000 / np.gradient(times)
    return Storyboard(_distinct(np.searchsorted(t, times), last), slowdown)


def _shares(lengths: np.ndarray) -> np.ndarray:
    """Shares of the frames for parts of the given lengths [s]: none is slower than the impact."""
    shares = np.array(SHARES) * (lengths > 0)
    impact = lengths[1]
    return np.minimum(shares, lengths * shares[1] / impact) if impact > 0 else shares


def _distinct(samples: np.ndarray, last: int) -> np.ndarray:
    """Strictly ascending samples near to the given ascending ones, none after ``last``."""
    order = np.arange(len(samples))
    ascending = np.maximum.accumulate(samples - order) + order
    found: np.ndarray = np.minimum(ascending, last - order[::-1])
    return found
