"""``alight check``: the certificate of a scenario."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from alight.cli.guard import FAILED
from alight.cli.options import AsJson, OutFolder, ScenarioName, Settings
from alight.cli.output import output_folder, show_json, show_tables, write_json
from alight.cli.progress import progress_bar
from alight.files import whole_file

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from alight.theory import Certificate


def check(
    scenario: ScenarioName, settings: Settings, out: OutFolder = None, as_json: AsJson = False
) -> None:
    """Say what is proven of a scenario: stability, forces, and what that assumes.

    Evaluates the conditions of Theorem 1 as printed and as corrected, what can be proven instead,
    the sampled loop, and bounds in newtons, each beside one simulated run. With --out the
    certificate is kept as certificate.json and certificate.md, with pictures of V along the run and
    of the stable region. Exits with 1 unless first contact, convergence and the sampled loop are
    all certified.
    """
    from alight.scenarios import load_scenario
    from alight.theory import check as certify
    from alight.theory import tables

    chosen = load_scenario(scenario, settings)
    with output_folder(out) as folder:
        with progress_bar(f"checking {chosen.name}"):
            made = certify(chosen)
        if as_json:
            show_json(made.as_dict())
        else:
            show_tables(tables(made))
        if folder is not None:
            keep_certificate(made, folder)
    if not made.certified:
        raise typer.Exit(FAILED)


def keep_certificate(made: Certificate, folder: Path) -> None:
    """Write a certificate and its pictures, each file whole or not at all.

    Raises
    ------
    AlightError
        If a file cannot be written; those before it stay.
    """
    from alight.figures import save
    from alight.theory import page

    write_json(made.as_dict(), folder / "certificate.json")
    with whole_file(folder / "certificate.md") as file:
        file.write(page(made).encode("utf-8"))
    save(_lyapunov(made), folder / "lyapunov.png")
    save(_region(made), folder / "region.png")


def _lyapunov(made: Certificate) -> Figure:
    import numpy as np

    from alight.figures import lyapunov

    traces = made.lyapunov
    values = {name: traces[name].value for name in ("V", "V_r", "V_m")}
    owed, most = (traces[name].upper for name in ("V_r", "V_r over the boxes"))
    assert owed is not None and most is not None  # both are bounded from above
    bounds = {"V_r": {"V_r(0) less the dissipation": owed, "R, over the boxes": most}}
    V_u = made.theorem_1.corrected.constant("V_u").value
    if V_u is not None:
        bounds["V"] = {"V_u of Theorem 1, corrected": np.full_like(owed, V_u)}
    return lyapunov(traces["V"].t, values, bounds, made.recording["Lambda"] > 0)


def _region(made: Certificate) -> Figure:
    from alight.figures import stable_region

    plane, gains = made.region, {"the scenario": made.case.law.gains}
    if made.nearest is not None:
        gains["nearest gains with VTX"] = made.nearest
    margins = {
        "LOC": plane.LOC,
        "LOC, adapting": plane.LOC_adapting,
        "VTX with the other gains of the ring": plane.VTX_moved,
        "VTX": plane.VTX,
    }
    points = {name: (g.alpha1, g.k1) for name, g in gains.items()}
    return stable_region(plane.alpha1, plane.k1, margins, points)
