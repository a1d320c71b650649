"""The verb that runs a scenario."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

from alight.control.law import Law
from alight.control.transition import ContactTransitionLaw
from alight.errors import AlightError
from alight.kernels.select import Backend
from alight.scenarios.laws import law_from
from alight.scenarios.load import load_scenario
from alight.scenarios.scenario import Scenario
from alight.simulation.recording import Recording
from alight.simulation.run import Progress, run


class RunFailed(AlightError):
    """A run that ended early; ``recording`` holds what was recorded up to there."""

    def __init__(self, recording: Recording) -> None:
        self.recording = recording
        super().__init__(str(recording.verdict))


def simulate(
    scenario: Scenario | str | Path,
    law: Law | type[Any] | None = None,
    *,
    seed: int | None = None,
    channels: tuple[str, ...] | None = None,
    every: int = 1,
    backend: Backend = "auto",
    progress: Progress | None = None,
    throw: bool = False,
) -> Recording:
    """Run a scenario and record it.

    Parameters
    ----------
    scenario : Scenario, or name or path of one
        What to run.
    law : Law or class of one, optional
        Your own law instead of the scenario's. A class on the paper's error system gets the
        scenario's ``[law]`` table; any other class is made without arguments.
    seed : int, optional
        Seed of the sensor noise instead of the scenario's.
    channels : tuple of str, optional
        Signals to record; all of them if absent.
    every : int
        Ticks between two recorded samples.
    backend : {"auto", "vm", "c", "lanes"}
        CasADi's virtual machine or compiled C, which give the same bits; ``auto`` compiles when
        that costs less than the work that is left, and keeps the program for later. ``lanes`` is
        the arithmetic of `simulate_batch` for one run: faster, and equal to rounding.
    progress : callable, optional
        Called now and then with the share that is done.
    throw : bool
        Raise `RunFailed` if the run ends early, instead of saying so in its verdict.

    Returns
    -------
    Recording
    """
    chosen = scenario if isinstance(scenario, Scenario) else load_scenario(scenario)
    if isinstance(law, type):
        law = own_law(law, chosen)
    if law is not None:
        chosen = chosen.with_law(law)
    used = chosen.document.seed if seed is None else seed
    recording = run(
        chosen.closed_loop,
        chosen.start,
        chosen.document.duration,
        seed=used,
        channels=channels,
        every=every,
        backend=backend,
        progress=progress,
    )
    recording = dataclasses.replace(recording, scenario={**chosen.description(), "seed": used})
    if throw and not recording.verdict.completed:
        raise RunFailed(recording)
    return recording


def own_law(cls: type[Any], scenario: Scenario) -> Law:
    """Make a law of one's own class for a scenario."""
    on_error_system = issubclass(cls, ContactTransitionLaw)
    table = scenario.document.law if on_error_system else {}
    settings = {key: value for key, value in table.items() if key != "type"}
    return law_from(cls, settings, scenario.plant, scenario.target)
