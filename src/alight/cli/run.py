"""``alight run``: one run of a scenario."""

from __future__ import annotations

import typer

from alight.cli.guard import FAILED
from alight.cli.options import AsJson, Backend, BackendName, OutFolder, ScenarioName, Seed, Settings
from alight.cli.output import output_folder, show, show_json
from alight.cli.progress import progress_bar


def run(
    scenario: ScenarioName,
    settings: Settings,
    out: OutFolder = None,
    as_json: AsJson = False,
    backend: Backend = BackendName.auto,
    seed: Seed = None,
) -> None:
    """Run a scenario and print what came of it.

    With --out the run is kept: recording.parquet and recording.mcap hold every signal,
    summary.json the printed figures, plan.png and torques.png pictures. Exits with 1 if the run
    ends early.
    """
    from alight.cli.summary import Summary
    from alight.scenarios import load_scenario, simulate

    chosen = load_scenario(scenario, settings)
    with output_folder(out) as folder:
        with progress_bar(f"running {chosen.name}") as report:
            recording = simulate(chosen, seed=seed, backend=backend.value, progress=report)
        summary = Summary(recording, chosen, chosen.document.seed if seed is None else seed)
        if as_json:
            show_json(summary.as_dict())
        else:
            show(summary.as_table(), summary.ending)
        if folder is not None:
            from alight.cli.keep import keep

            keep(summary, folder)
    if not recording.verdict.completed:
        raise typer.Exit(FAILED)
