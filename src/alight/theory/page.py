"""A certificate as tables: for a terminal, and as a Markdown page."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterable, Iterator, Sequence

from alight.control import Gains
from alight.tables import Table, markdown, number
from alight.theory.answers import QUESTIONS, answers
from alight.theory.certificate import Certificate
from alight.theory.condition import Condition, Constant
from alight.theory.newtons import Bound

STANDING = {"proven on the model (1)-(8)": "on the model"}
"""Short forms of what a bound rests on."""
HOLDS = {True: "yes", False: "NO", None: "undefined"}


def page(made: Certificate) -> str:
    """The certificate as a Markdown page."""
    return (
        f"# Certificate of {made.scenario.name}: {made.scenario.title}\n\n{markdown(tables(made))}"
    )


def tables(made: Certificate) -> list[Table]:
    """The certificate as tables, the answers first."""
    theorem = made.theorem_1
    return [
        _answers(made),
        _assumed(made),
        conditions_table("What is proven", made.propositions),
        _nearest(made),
        constants_table("What follows", made.constants),
        _newtons(made.newtons),
        *made.sampled.tables(),
        conditions_table("Theorem 1 as printed", theorem.printed.conditions),
        conditions_table("Theorem 1 as corrected", theorem.corrected.conditions),
        _joint(made),
        _readings(made),
    ]


def _answers(made: Certificate) -> Table:
    rows = list(zip(QUESTIONS, answers(made), strict=True))
    verdict = "certified" if made.certified else "not certified"
    return Table(f"{made.scenario.title}: {verdict}", ("", ""), rows)


def _assumed(made: Certificate) -> Table:
    rows = [(line.what, line.source, HOLDS[line.holds], line.found) for line in made.assumed]
    return Table("What is assumed", ("assumption", "where", "holds", "the scenario"), rows)


def conditions_table(title: str, conditions: Iterable[Condition], *notes: str) -> Table:
    """Conditions with both sides, margin, whether they hold, and what they mean."""
    rows = [
        (c.number, f"{c.statement}\n{_told(c.meaning, c.undefined)}", *_sides(c), HOLDS[c.holds])
        for c in conditions
    ]
    columns = ("", "condition", ">left", ">right", ">margin", "unit", "holds")
    return Table(title, columns, rows, notes)


def _sides(c: Condition) -> Sequence[str]:
    return (*(_value(side) for side in (c.left, c.right, c.margin)), c.unit)


def _value(value: float | None) -> str:
    return "-" if value is None else number(value)


def _told(meaning: str, undefined: str) -> str:
    return f"{meaning} No value: {undefined}." if undefined else meaning


def constants_table(title: str, constants: Iterable[Constant], *notes: str) -> Table:
    """Constants with unit and meaning, or why they have no value."""
    rows = []
    for why, alike in itertools.groupby(constants, key=lambda c: c.undefined):
        if why:
            members = list(alike)
            symbols = ", ".join(c.symbol for c in members)
            rows.append((symbols, members[0].number, "-", "", f"No value: {why}."))
        else:
            rows += [(c.symbol, c.number, _value(c.value), c.unit, c.meaning) for c in alike]
    return Table(title, ("", "from", ">value", "unit", "meaning"), rows, notes)


def _nearest(made: Certificate) -> Table:
    gains, nearest = made.case.law.gains, made.nearest
    title = "Nearest gains that satisfy VTX"
    if nearest is None:
        return Table(title, ("gain", ">scenario", ">nearest"), [], ("None was found.",))
    rows = [(name, *values) for name, *values in _gains(gains, nearest)]
    note = (
        "Nearest in the logarithms of k1, k2, alpha1, alpha2, alpha3; VTX holds with them over all "
        "of the assumptions, and the filter stays in its domain before contact. They are a point "
        "to start tuning from: VTX says nothing of speed, of forces, or of the sampled loop."
    )
    return Table(title, ("gain", ">scenario", ">nearest"), rows, (note,))


def _gains(gains: Gains, nearest: Gains) -> Iterator[tuple[str, str, str]]:
    for field in dataclasses.fields(gains):
        here, there = getattr(gains, field.name), getattr(nearest, field.name)
        if here != there:
            yield field.name, number(here), number(there)


def _newtons(bounds: Sequence[Bound]) -> Table:
    """Bounds that say the same of several axes, joints or entries share a row."""
    alike: dict[tuple[str, str, str], list[Bound]] = {}
    for b in bounds:
        key = (_stem(b.name), _told(b.meaning, b.undefined), b.unit)
        alike.setdefault(key, []).append(b)
    rows = [
        (
            "\n".join(
                [
                    _names(stem, group),
                    group[0].statement,
                    meaning,
                    *sorted({_idle(b) for b in group} - {""}),
                ]
            ),
            *("\n".join(cells) for cells in zip(*map(_figures, group), strict=True)),
            unit,
            STANDING.get(group[0].proven, group[0].proven),
        )
        for (stem, meaning, unit), group in alike.items()
    ]
    columns = ("bound", ">value", ">run", ">ratio", "", "unit", "standing")
    note = (
        "Vacuous: ten times what the run shows, or no less than motors or geometry allow anyway. "
        "On the model: proven on (1)-(8), without friction, damping, sampling and motor limits."
    )
    return Table("Bounds in newtons, beside one run", columns, rows, (note,))


def _stem(name: str) -> str:
    """What a name says before the axis, joint or entry that it speaks of."""
    stem, _, member = name.rpartition(", ")
    return stem if member.split(" ")[0] in ("axis", "joint", "entry") else name


def _names(stem: str, group: Sequence[Bound]) -> str:
    """The common part of their names once."""
    members = [b.name.removeprefix(f"{stem}, ") for b in group]
    return f"{stem}: {', '.join(members)}" if len(group) > 1 else group[0].name


def _figures(b: Bound) -> tuple[str, ...]:
    return (_interval(b), _value(b.simulated), _value(b.ratio), "vacuous" if b.vacuous else "")


def _idle(b: Bound) -> str:
    """What else says as much as a vacuous bound."""
    if b.known is None or b.size is None or b.size < b.known:
        return ""
    allowed = f"{number(b.known)} {b.unit}"
    return f"No more than {allowed} is possible anyway, because of {b.because}."


def _interval(b: Bound) -> str:
    if b.value is None or b.lower is None:
        return _value(b.value)
    return f"{number(b.lower)} … {number(b.value)}"


def _joint(made: Certificate) -> Table:
    joint = (*made.theorem_1.printed.joint, *made.theorem_1.corrected.joint)
    return conditions_table("What Theorem 1 asks of any gains", joint)


def _readings(made: Certificate) -> Table:
    printed, corrected = made.theorem_1.printed, made.theorem_1.corrected
    values = {c.symbol: c for c in corrected.constants}
    rows = []
    for c in printed.constants:
        other = values.get(c.symbol, c)
        told = _told(c.meaning, c.undefined)
        rows.append((c.symbol, c.number, _value(c.value), _value(other.value), c.unit, told))
    columns = ("", "from", ">printed", ">corrected", "unit", "meaning")
    return Table("Constants of Theorem 1", columns, rows)
