"""The verb that reproduces the paper."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from alight import figures
from alight.errors import AlightError
from alight.reproduction.claims import Claim, claims
from alight.reproduction.evidence import STEPS, Runs, gather
from alight.reproduction.report import write_claims, write_report
from alight.scenarios.load import identification_of

Progress = Callable[[float, str], None]
"""Told the share that is done, and what comes next."""


@dataclass(frozen=True)
class Reproduction:
    """Both experiments, and the verdict on each claim."""

    runs: Runs
    claims: list[Claim]

    @property
    def complete(self) -> bool:
        """Whether both experiments ran to their end."""
        runs = self.runs
        return all(r.verdict.completed for r in (runs.recording_1, runs.recording_2))


def reproduce(out: str | Path | None = None, progress: Progress | None = None) -> Reproduction:
    """Run both experiments and the variants that the claims need, and judge each claim.

    Parameters
    ----------
    out : str or Path, optional
        Folder for ``report.md``, ``claims.json``, the figures, the animation and the recordings
        (Parquet and MCAP); made if missing. Nothing is written if absent.
    progress : callable, optional
        Called with the share that is done and a few words.

    Raises
    ------
    AlightError
        If the folder or a file in it cannot be written.
    """
    folder = None if out is None else _folder(Path(out))
    told = progress or (lambda share, text: None)
    done, total = 0, STEPS + (2 if folder else 0)

    def step(text: str) -> None:
        nonlocal done
        told(done / total, text)
        done += 1

    runs, evidence = gather(step)
    judged = claims(evidence)
    if folder is not None:
        step("recordings and report")
        _write_records(folder, runs, judged)
        step("figures and animation")
        _write_figures(folder, runs)
    told(1.0, "done")
    return Reproduction(runs, judged)


def _folder(path: Path) -> Path:
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise AlightError(f"{path}: the folder cannot be made: {error.strerror}") from None
    return path


def _write_records(folder: Path, runs: Runs, judged: list[Claim]) -> None:
    for name, recording in (("experiment-1", runs.recording_1), ("experiment-2", runs.recording_2)):
        for suffix in ("parquet", "mcap"):
            recording.save(folder / f"{name}.{suffix}")
    write_claims(folder / "claims.json", judged)
    write_report(
        folder / "report.md",
        judged,
        [runs.scenario_1, runs.scenario_2],
        identification_of("experiment-1"),
    )


def _write_figures(folder: Path, runs: Runs) -> None:
    one, two = runs.recording_1, runs.recording_2
    figures.save(figures.errors(one, two), folder / "figure-4.png")
    figures.save(figures.torques(one), folder / "figure-5.png")
    figures.save(figures.desired_trajectory(one), folder / "figure-6.png")
    figures.save(figures.computed_torques(two), folder / "figure-7.png")
    figures.save(figures.applied_against_computed(two), folder / "figure-8.png")
    figures.save(figures.plan_view(one, runs.scenario_1), folder / "plan-view.png")
    figures.animate(one, runs.scenario_1, folder / "strike.gif")
