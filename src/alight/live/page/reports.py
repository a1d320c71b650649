"""What the panel reports, as HTML: certificate, host, log."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from alight.live.page.health import Health
from alight.live.page.news import Line
from alight.live.page.preview import Effect
from alight.live.page.preview import Line as Certified
from alight.live.page.widgets import safe

WORDS = {True: "holds", False: "fails", None: ""}


def certificate(
    now: Effect | None, draft: Effect | None, title: str = "Certificate, before applying"
) -> str:
    """The certificate of what is in force, beside that of a draft if there is one."""
    title = f"<h2>{safe(title)}</h2>"
    shown = draft or now
    if shown is None:
        return f"{title}<p>is being computed…</p>"
    if shown.problem:
        return f"{title}<p>No certificate: {safe(shown.problem)}.</p>"
    before = {line.name: line for line in now.lines} if now is not None else {}
    rows = [_row(line, before.get(line.name), draft is not None) for line in shown.lines]
    head = "<th>in force</th><th>draft</th>" if draft is not None else "<th>in force</th>"
    return f"{title}<table><tr><th></th>{head}</tr>{''.join(rows)}</table>"


def _row(line: Certified, before: Certified | None, drafted: bool) -> str:
    cells = _cell(before) + _cell(line) if drafted else _cell(line)
    of = ' class="differs"' if drafted and (before is None or before.told != line.told) else ""
    unit = f" <small>{safe(line.unit)}</small>" if line.unit else ""
    return f'<tr{of} title="{safe(line.meaning)}"><td>{safe(line.name)}{unit}</td>{cells}</tr>'


def _cell(line: Certified | None) -> str:
    if line is None:
        return '<td class="v">—</td>'
    word = f"<em>{WORDS[line.holds]}</em>" if line.holds is not None else ""
    return f'<td class="v {WORDS[line.holds]}">{safe(line.told)}{word}</td>'


def host(health: Health | None, rate: float) -> str:
    """How the host keeps time, and what the system permitted it."""
    if health is None:
        return "<h2>Host</h2>is starting; the laws are being compiled…"
    cells = (
        ("rate", f"{rate:.0f} Hz"),
        ("missed", f"{health.missed}"),
        ("late, 99 %", f"≤ {micro(health.late_99)}"),
        ("worst", micro(health.worst_late)),
        ("busy, 99 %", f"≤ {micro(health.busy_99)}"),
        ("worst", micro(health.worst_busy)),
    )
    pairs = [cells[i : i + 2] for i in range(0, len(cells), 2)]
    rows = "".join(
        "<tr>" + "".join(f'<td>{k}</td><td class="v">{safe(v)}</td>' for k, v in pair) + "</tr>"
        for pair in pairs
    )
    return f"<h2>Host timing</h2><table>{rows}</table>"


def scheduling(lines: Sequence[str]) -> str:
    """What the system permitted the host: one line that opens."""
    if not lines:
        return ""
    each = "".join(f"<div>{safe(line)}</div>" for line in lines)
    return f"<details><summary>{safe(' · '.join(lines))}</summary>{each}</details>"


def micro(seconds: float) -> str:
    """A short time in the unit that suits it."""
    if seconds < 1e-3:
        return f"{seconds * 1e6:.0f} µs"
    return f"{seconds * 1e3:.1f} ms" if seconds < 1 else f"{seconds:.1f} s"


def log(lines: Sequence[Line]) -> str:
    """The newest lines of the log first."""
    return "".join(_line(line) for line in reversed(lines))


def _line(line: Line) -> str:
    at = line.clock if line.t is None else f"{line.t:.3f} s"
    by = f" · {line.by}" if line.by else ""
    seek = "" if line.row is None else f' data-seek="{line.row}" tabindex="0"'
    hint = safe(f"{line.clock} {line.text}{by}".strip())
    kind = safe(line.kind)
    return (
        f'<div{seek} title="{hint}"><time>{safe(at)}</time>'
        f'<span class="{kind}">{_text(line)}{safe(by)}</span></div>'
    )


def _text(line: Line) -> str:
    heads = {"trip": "TRIP: ", "refused": "refused: "}
    return safe(heads.get(line.kind, "") + line.text)


def recorder(report: dict[str, Any]) -> tuple[str, str, str]:
    """Recording indicator: main text, what stands below it, and how it is."""
    if not report:
        return "no recorder", "nothing is recorded", "bad"
    problem = str(report.get("problem") or "")
    name = str(report.get("file") or "").rpartition("/")[2]
    if report.get("state") == "recording" and not problem:
        lost = f", {report.get('lost')} rows lost" if report.get("lost") else ""
        seconds, size = float(report.get("seconds") or 0), float(report.get("bytes") or 0)
        return name, f"{seconds:.1f} s, {size / 1e6:.1f} MB{lost}", "bad" if lost else "on"
    if problem or report.get("state") == "failed":
        return "recording failed", problem, "bad"
    return "recorder ready", f"last: {name}" if name else "records while running", ""


def joined(texts: Iterable[str]) -> str:
    """Texts in one line."""
    return " · ".join(text for text in texts if text)
