"""What was measured, as tables."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from alight.tables import Table, number

Results = Mapping[str, Any]


def tables(results: Results) -> list[Table]:
    """Every table of some results."""
    made = [_machine(results)]
    for name, section in results["sections"].items():
        made += list(_TABLES[name](section))
    if results["budget"]:
        made.append(_budget(results["budget"]))
    return made


# Numbers


def ratio(found: Results) -> str:
    """Median, and the least and greatest sample."""
    middle, low, high = (number(found[key]) for key in ("median", "low", "high"))
    return f"{middle} ({low}–{high})"


def duration(seconds: float) -> str:
    """A time with a unit of its size."""
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if abs(seconds) >= size:
            return f"{number(seconds / size)} {unit}"
    return f"{number(seconds * 1e9)} ns"


# Sections


def _machine(results: Results) -> Table:
    machine, versions = results["machine"], results["versions"]
    installed = ", ".join(f"{name} {value}" for name, value in versions.items() if value)
    rows = [
        ("date", machine["date"]),
        ("command", results["command"]),
        ("processor", f"{machine['processor']}; {machine['processors']} processors"),
        ("lanes", f"{machine['lanes']} of double precision"),
        ("system", f"{machine['system']}, Python {machine['python']}"),
        ("plain C", f"{machine['plain_compiler']}: {machine['flags']}"),
        ("Alight's C for lanes", f"{machine['compiler']}: {machine['lane_flags']}"),
        ("versions", installed),
        ("kept to one core", "yes" if machine["pinned"] else "no: the system does not permit it"),
        ("load at the start", "unknown" if machine["load"] is None else str(machine["load"])),
        ("took", f"{results['minutes']:.1f} min"),
    ]
    notes = []
    if results["quick"]:
        notes.append("Measured quickly: such figures show that it runs, not how fast.")
    return Table("Machine", ("", ""), rows, notes)


def _peers(section: Results) -> Iterator[Table]:
    rows = []
    for row in section["rows"]:
        known = (row["name"], str(row["batch"]), row["loop"])
        if "ratio" in row:
            errors = (number(row["error"]["q"]), number(row["error"]["x_m"]))
            if not row["same"]:
                errors = ("another run!", *errors[1:])
            figures = (ratio(row["ratio"]), str(row["ratio"]["count"]), *errors)
        else:
            told = row.get("failed") or f"not installed: {row['missing']}"
            figures = (told, "", "", "")
        rows.append((*known, *figures))
    yield Table(
        "Peers on the same closed loop",
        ("peer", ">runs", "loop", ">time of a run / R", ">samples", ">q [rad]", ">x_m [m]"),
        rows,
        (
            "R is the time of the plain C. The last columns hold the largest errors of the first "
            f"{section['shown']:g} s of a run, or of all of it if it is shorter. A sampled loop is "
            "compared with the reference of the sampled loop, a continuous one with that of the "
            "continuous loop: with and without sampling the physics differ.",
        ),
    )
    how = [
        (row["name"], f"{row['package']} {row['version'] or '-'}", row["how"])
        for row in sorted(section["rows"], key=lambda row: row["place"])
    ]
    yield Table("What each peer does", ("peer", "package", "how"), how)


def _runs(section: Results) -> Iterator[Table]:
    names = {"c": "compiled", "lanes": "compiled, one lane", "vm": "virtual machine"}
    rows = [
        (
            row["scenario"],
            names[row["backend"]],
            row["channels"],
            str(row["steps"]),
            duration(row["seconds"]["median"]),
            f"{ratio(row['ratio'])} {row['unit']}",
        )
        for row in section["rows"]
    ]
    columns = ("scenario", "backend", "recorded", ">steps", ">10 s take", ">time")
    yield Table("One run of Alight", columns, rows, (_R_PRIME,))


_R_PRIME = (
    "R' is the time of plain C with all that the scenario has (friction, sensors, quantisation, "
    "noise, and the recording or the metrics of its row), with four plain Runge-Kutta steps in a "
    "sample."
)


def _batch(section: Results) -> Iterator[Table]:
    rows = [
        (
            row["scenario"],
            f"{row['runs']:,}",
            f"{row['completed']:,}",
            str(row["steps"]),
            f"{ratio(row['ratio'])} {row['unit']}",
        )
        for row in section["rows"]
    ]
    columns = ("scenario", ">runs", ">completed", ">steps", ">time of a run")
    times = f"With metrics R' is {ratio(section['full_per_ideal'])} R."
    notes = ("One thread; 10 s each; m and k_s vary by 10 %; all metrics are gathered.", times)
    yield Table("A batch of Alight", columns, rows, notes)


def _law(section: Results) -> Iterator[Table]:
    rows = [
        (row["way"], duration(row["tick"]), duration(row["in_c"]), ratio(row["ratio"]))
        for row in section["rows"]
    ]
    columns = ("called from Python by", ">a tick", ">the C in a loop of C", ">ratio")
    yield Table("One tick of the law", columns, rows)


def _threads(section: Results) -> Iterator[Table]:
    rows = [(str(row["threads"]), ratio(row["rate"])) for row in section["rows"]]
    count, cores = section["processors"], section["cores"]
    note = f"{count} processors, which the system says belong to {cores} cores."
    if not rows:
        rows, note = [("1", "1")], "There is one processor only: nothing to scale over."
    yield Table("Threads", (">threads", ">rate over one thread"), rows, (note,))


def _lanes(section: Results) -> Iterator[Table]:
    rows = [
        (row["compiler"], "", "failed")
        if "failed" in row
        else (row["compiler"], str(row["width"]), ratio(row["ratio"]))
        for row in section["rows"]
    ]
    note = f"Batches of {section['runs']} runs."
    yield Table("Lanes", ("compiler", ">lanes", ">time of a run / R"), rows, (note,))


def _costs(section: Results) -> Iterator[Table]:
    starts = section["starts"]
    rows = [(name, duration(found["median"])) for name, found in starts.items()]
    rows.append(("import alight, alone", duration(section["import_alight"])))
    yield Table("Starting", ("a process that runs", ">takes"), rows)
    names = {
        "building": "building the tick of experiment-1",
        "emitting": "writing it as C for lanes",
        "compiling": "compiling it for single runs",
        "compiling_lanes": "compiling it for lanes",
        "loading": "loading it when it is kept already",
    }
    once = [(text, duration(section["once"][name])) for name, text in names.items()]
    yield Table("Paid once", ("what", ">takes"), once)
    memory = [
        (f"{row['runs']:,} runs of {row['duration']:g} s", _mib(row["before"]), _mib(row["after"]))
        for row in section["memory"]
    ]
    columns = ("batch", ">peak of a batch of 8", ">peak")
    yield Table("Memory of a process", columns, memory)


def _mib(size: float) -> str:
    return f"{size / 2**20:,.0f} MiB"


def _floor(section: Results) -> Iterator[Table]:
    functions = ", ".join(f"{n} {name}" for name, n in sorted(section["functions"].items()))
    tick = section["tick"]
    rows = [
        ("additions, multiplications", f"{section['arithmetic']:,}"),
        ("quotients and roots", f"{section['quotients']:,}"),
        (f"functions ({functions})", f"{section['function_operations']:,} operations"),
        ("all instructions of arithmetic", f"{section['operations']:,}"),
        ("all operations, a fused multiply-add as two", f"{section['flops']:,}"),
        ("selections, comparisons: not counted", f"{section['choices']:,}"),
        ("peak of a core, fused multiply-adds", f"{number(section['fused_flops'] / 1e9)} GFLOP/s"),
        ("peak of a core, single operations", f"{number(section['single_flops'] / 1e9)} GFLOP/s"),
        ("a tick at the first peak", duration(section["if_fused"])),
        ("a tick at the second peak", duration(section["if_single"])),
        ("a tick as it is", duration(tick)),
        ("share of the second peak", f"{section['if_single'] / tick:.0%}"),
    ]
    yield Table("Arithmetic floor of a batch, for one tick of one run", ("", ">"), rows)


def _accuracy(section: Results) -> Iterator[Table]:
    rows = [
        (
            row["scenario"],
            ("located" if row["located"] else "plain")
            + (", default" if row["located"] and row["usual"] else ""),
            str(row["steps"]),
            *(number(row["error"][channel]) for channel in ("q", "x_m", "F_m")),
        )
        for row in sorted(section["rows"], key=lambda r: (r["scenario"], not r["located"]))
    ]
    columns = ("scenario", "switch of contact", ">steps", ">q [rad]", ">x_m [m]", ">F_m [N]")
    note = (
        f"Largest errors over {section['duration']:g} s against the reference, which integrates "
        "between samples to tight tolerances and locates each switch. Plain steps are classical "
        "Runge-Kutta steps. The default is compared with four of them in the budget."
    )
    yield Table("Accuracy", columns, rows, (note,))


def _live(section: Results) -> Iterator[Table]:
    period = 1 / section["sample_rate"]
    rows = [
        (row["way"], duration(row["tick"]), ratio(row["ratio"]), f"{row['tick'] / period:.1%}")
        for row in section["rows"]
    ]
    columns = ("what", ">takes", ">over the bare tick", f">of {duration(period)}")
    note = (
        "Each line but the last holds what the lines above it do. The recorder is a process of its "
        "own on another core; it encodes, writes and forces to the disk a quarter of a second at a "
        "time. Waiting for the deadline is left out."
    )
    yield Table("One tick of the live bench", columns, rows, (note,))


def _budget(lines: Sequence[Results]) -> Table:
    rows = []
    for line in lines:
        sense = "at least" if line["at_least"] else "at most"
        unit = f" {line['unit']}" if line["unit"] else ""
        holds = "holds" if line["holds"] else "does not hold"
        limit = f"{sense} {number(line['limit'])}{unit}"
        rows.append((line["what"], f"{number(line['figure'])}{unit}", limit, holds))
    return Table("Budget", ("what", ">figure", ">limit", ""), rows)


_TABLES: Mapping[str, Callable[[Results], Iterator[Table]]] = {
    "peers": _peers,
    "runs": _runs,
    "batch": _batch,
    "law": _law,
    "threads": _threads,
    "lanes": _lanes,
    "costs": _costs,
    "floor": _floor,
    "accuracy": _accuracy,
    "live": _live,
}
