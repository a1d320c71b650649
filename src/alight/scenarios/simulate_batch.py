"""The verb that runs a scenario many times."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from alight.control.law import PlainLaw
from alight.errors import AlightError, UnknownName
from alight.kernels.select import Backend
from alight.scenarios.load import load_scenario
from alight.scenarios.scenario import Scenario
from alight.scenarios.varied import SEED, Variation, Varied
from alight.simulation.batch import WIDTHS, Outcomes, Request, run_batch
from alight.simulation.ending import ending
from alight.simulation.metrics import METRICS, chosen
from alight.simulation.run import Progress
from alight.simulation.verdict import Verdict


@dataclass(frozen=True)
class Batch:
    """Many runs of a scenario: figures of each, and what was recorded.

    ``batch["peak_F_m"]`` is a metric, shape (n,) or (n, size); ``batch["e_m"]`` a recorded
    channel, shape (n, samples) or (n, samples, size), NaN after the end of a run. Units are SI and
    stand in ``batch.units``.
    """

    scenario: Scenario
    varied: Mapping[str, np.ndarray]
    """Values that differ from run to run, by path."""
    t: np.ndarray
    """Time of each recorded sample [s], shape (samples,)."""
    outcomes: Outcomes

    def __len__(self) -> int:
        return len(self.outcomes.trip)

    def __getitem__(self, name: str) -> np.ndarray:
        recorded = self.outcomes.recorded
        if name in self.outcomes.metrics:
            return self.outcomes.metrics[name]
        if name not in recorded.signals:
            raise UnknownName("metric or channel", name, (*self.metrics, *recorded.signals))
        entries = self.outcomes.samples[:, :, recorded.slices()[name]]
        return entries[:, :, 0] if entries.shape[2] == 1 else entries

    @property
    def metrics(self) -> dict[str, np.ndarray]:
        """Every metric by name."""
        return self.outcomes.metrics

    @property
    def units(self) -> dict[str, str]:
        """Unit of each metric and channel."""
        channels = self.outcomes.recorded.signals
        return {
            **{name: METRICS[name].signal.unit for name in self.metrics},
            **{name: signal.unit for name, signal in channels.items()},
        }

    @property
    def completed(self) -> np.ndarray:
        """Whether each run reached its end, shape (n,)."""
        return self.outcomes.trip == 0

    @property
    def end(self) -> np.ndarray:
        """Time of the last sample of each run [s], that of the trip if it tripped, shape (n,)."""
        ticks = np.where(self.completed, self.outcomes.ticks - 1, self.outcomes.ticks)
        return ticks * self.scenario.closed_loop.dt

    def verdict(self, run: int) -> Verdict:
        """How a run ended, and why."""
        code, plant = int(self.outcomes.trip[run]), self.outcomes.plant[run]
        return ending(code, float(self.end[run]), self.scenario.law, plant)

    def to_pandas(self) -> Any:
        """One row for each run: what was varied, the metrics, end and outcome."""
        import pandas as pd

        verdicts = [self.verdict(run) for run in range(len(self))]
        columns: dict[str, Any] = {}
        for name, values in {**self.varied, **self.metrics}.items():
            if values.ndim == 1:
                columns[name] = values
            else:
                columns |= {f"{name}{i + 1}": values[:, i] for i in range(values.shape[1])}
        columns["end"] = self.end
        columns["outcome"] = [verdict.outcome.name for verdict in verdicts]
        columns["cause"] = [verdict.cause for verdict in verdicts]
        return pd.DataFrame(columns)


def _refuse_settings(every: int, threads: int | None, width: int | None) -> None:
    if every < 1 or every != int(every):
        raise AlightError(f"every = {every}: must be a whole number, 1 or more")
    if threads is not None and threads < 1:
        raise AlightError(f"threads = {threads}: must be 1 or more")
    if width not in (None, *WIDTHS):
        raise UnknownName("width", width, map(str, WIDTHS))


def simulate_batch(
    scenario: Scenario | str | Path,
    varied: Varied,
    *,
    metrics: Sequence[str] | None = None,
    channels: Sequence[str] = (),
    every: int = 1,
    backend: Backend = "auto",
    threads: int | None = None,
    width: int | None = None,
    progress: Progress | None = None,
) -> Batch:
    """Run a scenario many times, with other numbers in each run.

    The runs advance side by side in the lanes of the processor's vector unit, and over threads.
    Metrics are gathered tick by tick, so that memory does not grow with the length of the runs;
    only ``channels`` are recorded. A run that trips ends alone, and its metrics are those of the
    ticks before.

    Parameters
    ----------
    scenario : Scenario, or name or path of one
        What to run.
    varied : mapping
        Values by path, as those of ``load_scenario``: ``{"plant.body.m": masses}``. The first axis
        of each array counts the runs. ``"seed"`` gives each run noise of its own; otherwise all
        share the noise of the scenario's seed. What a scenario's law is told of its plant (the
        link lengths, say) varies along with the plant.
    metrics : sequence of str, optional
        Names out of `alight.simulation.metrics.METRICS`; all that the law's signals allow if
        absent.
    channels : sequence of str
        Signals to record.
    every : int
        Ticks between two recorded samples.
    backend : {"auto", "vm", "c"}
        ``auto`` compiles where it can; without a compiler the runs go one by one.
    threads : int, optional
        Threads to use; one for each processor if absent.
    width : int, optional
        Lanes to use, 1, 2, 4 or 8; those of the processor if absent.
    progress : callable, optional
        Called now and then with the share that is done.

    Returns
    -------
    Batch

    Raises
    ------
    InvalidParameters
        If a path may not vary, or a value is refused: path, run, value, and what would be right.
    UnknownName
        If there is no such metric or channel.
    AlightError
        If the law is in plain Python, or the recordings do not fit into memory.
    """
    base = scenario if isinstance(scenario, Scenario) else load_scenario(scenario)
    if isinstance(base.law, PlainLaw):
        raise AlightError("a law in plain Python runs in no batch; use alight.simulate in a loop")
    _refuse_settings(every, threads, width)
    variation = Variation(base, varied)
    loop = variation.loop
    request = Request(
        ticks=max(round(base.document.duration / loop.dt), 1),
        steady_state=base.document.steady_state,
        metrics=chosen(metrics, loop.signals),
        channels=tuple(channels),
        every=int(every),
        backend=backend,
        threads=threads,
        width=width,
    )
    outcomes = run_batch(loop, variation.runs(), request, progress)
    t = np.arange(request.samples if channels else 0) * every * loop.dt
    seeds = {SEED: variation.seeds} if SEED in varied else {}
    return Batch(base, {**variation.values, **seeds}, t, outcomes)
