"""From commands and states in the rows to the events of a run."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import Any

from alight.live.bank import Bank, parameter_column
from alight.live.record.place import InForce
from alight.live.session import Link
from alight.live.shared.commands import Kind, Outcome
from alight.live.shared.meaning import EVENT_OF, meaning_of
from alight.simulation.recording_events import Event, EventKind

TARGET = "law.target."


class Happenings:
    """What the commands of a host were, and what is in force after them."""

    def __init__(self, link: Link, bank: Bank) -> None:
        self._link, self._bank = link, bank

    @property
    def opening(self) -> InForce:
        """What is in force before the first command."""
        return InForce(0, 0, tuple(parameter_column(self._bank.loops[0]).tolist()))

    def after(self, before: InForce, last: int) -> InForce:
        """What is in force after the commands up to number ``last``."""
        for number in range(before.command + 1, last + 1):
            command = self._link.commands.command(number)
            if command is None:
                before = dataclasses.replace(before, certain=False)
            elif command.kind in (Kind.PARAMETERS, Kind.LAW) and self._applied(number):
                values = tuple(command.values.tolist())
                before = dataclasses.replace(before, law=command.law, parameters=values)
        return dataclasses.replace(before, command=max(last, before.command))

    def start_before(self, last: int) -> int:
        """Number of the last command START up to ``last``; 0 if it is no longer kept."""
        for number in range(last, max(last - 1024, 0), -1):
            if self._link.commands.kind_of(number) is Kind.START and self._applied(number):
                return number
        return 0

    def events(self, numbers: range, row: int, t: float) -> Iterator[Event]:
        """The events of commands that a row is the first to show."""
        for number in numbers:
            command = self._link.commands.command(number)
            if command is None:
                text = f"command {number} was no longer to be read"
                yield Event(row, t, EventKind.RECORDER, text, number)
                continue
            meaning = meaning_of(self._link.commands.text_of(number))
            changes = meaning.get("values")
            changes = changes if isinstance(changes, dict) else {}
            answer = self._link.commands.answer(number)
            kind = EVENT_OF[command.kind]
            if kind is EventKind.GAINS and changes and all(p.startswith(TARGET) for p in changes):
                kind = EventKind.TARGET
            text = self._text(command.kind, command.law, command.values.tolist(), changes)
            if meaning.get("by"):
                text += f", by {meaning['by']}"
            if answer.outcome is not Outcome.APPLIED:
                kind, text = EventKind.REFUSED, f"{text}: refused, {answer.reason}"
            law = self._law(command.law) if command.kind in (Kind.LAW, Kind.PARAMETERS) else ""
            values = tuple(command.values.tolist())
            yield Event(row, t, kind, text, number, law, values, changes)

    def _text(self, kind: Kind, law: int, values: list[float], changes: dict[str, Any]) -> str:
        if kind is Kind.KICK:
            torque1, torque2, duration = (*values, 0.0, 0.0, 0.0)[:3]
            return f"kick of {torque1:g} and {torque2:g} N m for {duration:g} s"
        changed = ", ".join(f"{path} = {_short(value)}" for path, value in changes.items())
        if kind is Kind.LAW:
            return f"law {self._law(law)}" + (f" with {changed}" if changed else "")
        if kind is Kind.PARAMETERS:
            return changed or "parameters set"
        return str(EVENT_OF[kind])

    def _law(self, number: int) -> str:
        names = self._bank.names
        return names[number] if number < len(names) else str(number)

    def _applied(self, number: int) -> bool:
        return self._link.commands.answer(number).outcome is Outcome.APPLIED


def _short(value: Any) -> str:
    if isinstance(value, list):
        return f"[{', '.join(_short(v) for v in value)}]"
    return f"{value:.6g}" if isinstance(value, float) else str(value)
