"""The error of fixed steps, drawn."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from matplotlib.figure import Figure

CHANNELS = {"q": "joint angles [rad]", "x_m": "mass [m]", "F_m": "impact force [N]"}


def convergence(section: Mapping[str, Any]) -> Figure:
    """Error of each channel over the steps in a sample, one panel for each channel."""
    figure = Figure(figsize=(10, 3.4), layout="constrained")
    names = list(dict.fromkeys(row["scenario"] for row in section["rows"]))
    for axes, (channel, label) in zip(figure.subplots(1, 3), CHANNELS.items(), strict=True):
        for i, name in enumerate(names):
            for located, style in ((True, "o-"), (False, "s--")):
                rows = [r for r in section["rows"] if r["scenario"] == name]
                rows = [r for r in rows if r["located"] is located and r["error"][channel]]
                how = "located" if located else "plain"
                axes.loglog(
                    [row["steps"] for row in rows],
                    [row["error"][channel] for row in rows],
                    style,
                    color=f"C{i}",
                    label=f"{name}, {how}",
                )
        steps = sorted({row["steps"] for row in section["rows"]})
        axes.set_xticks(steps, [str(n) for n in steps])
        axes.minorticks_off()
        axes.set(title=f"Error of the {label}", xlabel="steps in a sample")
        axes.grid(alpha=0.3)
    lines, labels = axes.get_legend_handles_labels()
    figure.legend(lines, labels, loc="outside lower center", ncols=len(labels), fontsize="small")
    return figure
