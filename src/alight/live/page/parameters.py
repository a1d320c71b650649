"""The panel of parameters: tabs of fields, the draft, and what is done with it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from nicegui import ui
from nicegui.element import Element

from alight.errors import AlightError
from alight.files import FileError
from alight.live.cycle import LONGEST_KICK
from alight.live.page.bench import Bench, InForce
from alight.live.page.draft import Draft, taking_over
from alight.live.page.fields import Bounds, Field, fields_of
from alight.live.page.news import shown
from alight.live.page.save import save_scenario
from alight.live.page.widgets import Native, NumberField, box, button, enable, html, safe, switch
from alight.live.shared.commands import Answer, Outcome
from alight.live.shared.status import State
from alight.simulation.closed_loop import ClosedLoop
from alight.symbolic.parameters import Quantity

TABS = {
    "Gains": ("law.gains",),
    "Adaptation": ("law.Gamma_r",),
    "Target": ("law.target",),
}


@dataclass
class Pilot:
    """Who acts, and whether it may."""

    name: str
    steers: Callable[[], bool]


class Parameters:
    """Fields for every number of the law, for a kick, and the choice of the law.

    Parameters
    ----------
    bench : Bench
        What is steered.
    pilot : Pilot
        Who does it.
    changed : callable
        Told of each draft: the closed loop, or None if something is wrong with it.
    """

    def __init__(
        self, bench: Bench, pilot: Pilot, changed: Callable[[ClosedLoop | None], None]
    ) -> None:
        self._bench, self._pilot, self._changed = bench, pilot, changed
        self._seen = bench.in_force
        self.draft = Draft(bench.bank, bench.in_force.law, bench.in_force.loop)
        self._fields: dict[str, NumberField] = {}
        self._tabs: dict[str, tuple[Native, Element]] = {}
        self._busy = False
        self._kick: dict[str, tuple[Field, float]] = {}
        self._build()
        self.choose_tab("Gains")

    # What stands there

    def _build(self) -> None:
        names = [*TABS, "Disturb", "Law"]
        with box("al-tabs").props('role="tablist"'):
            buttons = {n: button(n, partial(self.choose_tab, n)) for n in names}
        with box("al-fields"):
            for name in names:
                with box("") as content:
                    self._fill(name, content)
                self._tabs[name] = (buttons[name], content)
        with box("al-actions"):
            self._apply = button("Apply", self._on_apply, "primary", "Put the draft in force")
            self._apply.mark("apply")
            self._revert = button("Revert", self._on_revert, "", "Back to what is in force")
            self._save = button("Save as…", self._on_save, "", "Keep the draft as a scenario file")
        self._outcome = Native("div", "", "al-outcome")

    def _fill(self, name: str, content: Element) -> None:
        if name == "Disturb":
            self._fill_kick()
        elif name == "Law":
            self._laws = html("al-laws")
            self._laws.on(
                "click",
                lambda event: self._on_law(int(event.args)),
                js_handler="(event) => { const chosen = event.target.closest('[data-law]'); "
                "if (chosen) emit(chosen.dataset.law); }",
            )
        else:
            self._fill_fields(name, content)

    def _fill_fields(self, name: str, content: Element) -> None:
        loop, nominal = self.draft.base, self._bench.bank.loops[self.draft.number]
        items = fields_of(loop, *TABS[name])
        content.clear()
        with content:
            if not items:
                Native("div", "This law has none of these.", "al-say")
            for item in items:
                self._fields[item.key] = NumberField(item, item.of(nominal), self._on_typed)

    def _fill_kick(self) -> None:
        Native("div", "A torque on top of the law's, for a moment; the motors clip it.", "al-say")
        motors = self._bench.scenario.testbed.motors.limit
        for i, limit in enumerate(motors):
            quantity = Quantity("N m", f"torque at joint {i + 1}, added to that of the law")
            item = Field("kick", i, quantity, Bounds(-float(limit), float(limit)))
            self._kick_field(item, 0.0)
        quantity = Quantity("s", "how long it pushes")
        self._kick_field(Field("duration", None, quantity, Bounds(0.001, LONGEST_KICK)), 0.05)
        self._push = button("Kick", self._on_kick, "go", "Push now")
        self._pushed = Native("div", "", "al-outcome")

    def _kick_field(self, item: Field, value: float) -> None:
        self._kick[item.key] = (item, value)
        field = NumberField(item, value, self._on_kick_typed)
        field.show(value, "", "", locked=False, renew=True)
        self._fields[f"kick:{item.key}"] = field

    def choose_tab(self, name: str) -> None:
        """Show one tab."""
        for other, (tab, content) in self._tabs.items():
            switch(tab, "on", other == name)
            switch(content, "al-hidden", other != name)

    # Renewing what is shown

    @property
    def may(self) -> bool:
        """Whether this page may act now."""
        return self._pilot.steers() and self._bench.alive and not self._busy

    def refresh(self) -> None:
        """Follow what is in force, and who may do what."""
        if self._bench.in_force is not self._seen:
            self._rebase(self._bench.in_force)
        self._show(renew=False)

    def _rebase(self, now: InForce) -> None:
        """Something else is in force: the draft of another page's law gives way."""
        was, self._seen = self._seen, now
        if now.law != was.law or self.draft.number != now.law:
            self._begin(now.law, now.loop)
        else:
            self.draft.base = now.loop
            self._again()
        self._show(renew=True)
        self._changed(self.draft.loop())

    def _begin(self, number: int, base: ClosedLoop) -> None:
        """A draft of another law: its fields are others."""
        texts = dict(self.draft.texts)
        self.draft = Draft(self._bench.bank, number, base, texts)
        for name in TABS:
            self._fill_fields(name, self._tabs[name][1])
        self._again()

    def _again(self) -> None:
        """Take every text once more: what it is to be compared with has changed."""
        for key, text in list(self.draft.texts.items()):
            if key in self._items:
                self.draft.set(self._items[key], text)
            else:
                self.draft.texts.pop(key)

    @property
    def _items(self) -> dict[str, Field]:
        return {f.key: f for paths in TABS.values() for f in fields_of(self.draft.base, *paths)}

    def _show(self, *, renew: bool) -> None:
        draft, may, touched = self.draft, self.may, set()
        for key, item in self._items.items():
            if key in draft.texts:
                touched.add(next(n for n, paths in TABS.items() if item.path.startswith(paths)))
            self._fields[key].show(
                item.of(draft.base),
                draft.texts.get(key, ""),
                draft.problems.get(key, ""),
                locked=not self._pilot.steers(),
                renew=renew,
            )
        for name, (tab, _) in self._tabs.items():
            switch(tab, "changed", name in touched or (name == "Law" and self._other_law))
        wrong = bool(draft.problems)
        self._apply.text = self._label()
        enable(self._apply, may and not wrong and bool(draft.values or self._other_law))
        enable(self._revert, self._pilot.steers() and bool(draft.texts or self._other_law))
        enable(self._save, not wrong)
        enable(self._push, may and self._bench.state is State.RUNNING and not self._kick_wrong())
        self._laws.content = self._law_choice()

    @property
    def _other_law(self) -> bool:
        return self.draft.number != self._seen.law

    def _label(self) -> str:
        count = len(self.draft.values) + self._other_law
        return "Apply" if not count else f"Apply {count} change{'s' if count > 1 else ''}"

    def _law_choice(self) -> str:
        rows = []
        for number, (name, loop) in enumerate(
            zip(self._bench.bank.names, self._bench.bank.loops, strict=True)
        ):
            on = ' class="on"' if number == self.draft.number else ""
            now = "<em>in force</em>" if number == self._seen.law else ""
            now += "<em>draft</em>" if on and number != self._seen.law else ""
            text = (type(loop.law).__doc__ or "").strip().partition("\n")[0].replace("``", "")
            rows.append(
                f'<label{on} data-law="{number}" tabindex="0"><b>{safe(name)}</b>{now}'
                f"<small>{safe(text)}</small></label>"
            )
        say = "It takes over between two ticks, with gains, target and shared state kept."
        return f'<div class="al-say">{say}</div>{"".join(rows)}'

    def _say(self, text: str, kind: str = "") -> None:
        self._outcome.text = text
        self._outcome.classes(replace=f"al-outcome {kind}")

    # What is done

    def _on_typed(self, item: Field, text: str) -> None:
        if self._pilot.steers():
            self.draft.set(item, text)
            loop = self.draft.loop()
            self._say(self.draft.problems.get("", ""), "bad")
            self._show(renew=False)
            self._changed(loop)

    def _on_law(self, number: int) -> None:
        if not self._pilot.steers() or not 0 <= number < len(self._bench.bank.loops):
            return
        now = self._seen
        same = number == now.law
        self._begin(number, now.loop if same else taking_over(self._bench.bank, number, now.loop))
        self._show(renew=True)
        self._changed(self.draft.loop())

    def _on_revert(self) -> None:
        if not self._pilot.steers():
            return
        if self._other_law:
            self._begin(self._seen.law, self._seen.loop)
        self.draft.revert()
        self._say("")
        self._show(renew=True)
        self._changed(self.draft.loop())

    async def _on_apply(self) -> None:
        loop = self.draft.loop()
        if loop is None or not self.may:
            self._say(self.draft.problems.get("", ""), "bad")
            return
        self._busy = True
        try:
            answer = await self._bench.apply(self._pilot.name, self.draft.number, loop)
        except AlightError as error:
            self._say(str(error), "bad")
            return
        finally:
            self._busy = False
        self._say(*_told(answer, self._bench))
        if answer.outcome is Outcome.APPLIED:
            self.draft.revert()
            self.refresh()
            self._show(renew=True)

    def _on_kick_typed(self, item: Field, text: str) -> None:
        try:
            value = float(text.strip().replace(",", "."))
        except ValueError:
            value = float("nan")
        self._kick[item.key] = (item, value)
        default = 0.0 if item.path == "kick" else 0.05
        self._fields[f"kick:{item.key}"].show(
            default, text, item.bounds.problem(value), locked=False, renew=False
        )

    def _kick_wrong(self) -> bool:
        return any(item.bounds.problem(value) for item, value in self._kick.values())

    async def _on_kick(self) -> None:
        if not self.may or self._kick_wrong():
            return
        one, two, duration = (value for _, value in self._kick.values())
        try:
            answer = await self._bench.kick(self._pilot.name, (one, two), duration)
        except AlightError as error:
            self._pushed.text = str(error)
            return
        self._pushed.text = _told(answer, self._bench)[0]

    async def _on_save(self) -> None:
        loop = self.draft.loop()
        if loop is not None:
            await Saving(self._bench, self.draft.number, loop, self._say).ask()


class Saving:
    """The dialog that asks for the name of a scenario file, and does not replace one unasked."""

    def __init__(
        self, bench: Bench, number: int, loop: ClosedLoop, say: Callable[..., None]
    ) -> None:
        self._bench, self._what, self._tell = bench, (number, loop), say
        self._folder = Path(bench.session.settings.recordings)
        self._name = f"{bench.scenario.name}-bench.toml"

    async def ask(self) -> None:
        """Show the dialog until it is saved or given up."""
        with ui.dialog() as self._dialog, box("al-dialog"):
            Native("h2", "Save the draft as a scenario")
            Native("div", f"Folder: {self._folder.resolve()}", "al-say")
            field = ui.input("File name", value=self._name, on_change=self._on_name)
            field.props("dense outlined autofocus").classes("al-file")
            self._note = Native("div", "", "al-outcome bad")
            with box("row"):
                button("Cancel", self._dialog.close)
                self._write = button("Save", self._on_save, "primary")
        await self._dialog
        self._dialog.delete()

    def _on_name(self, event: Any) -> None:
        self._name = str(event.value)[:120].strip()
        self._write.text, self._note.text = "Save", ""

    async def _on_save(self) -> None:
        replace = self._write.text != "Save"
        try:
            path = await asyncio.to_thread(
                save_scenario,
                self._folder,
                self._name,
                self._bench.bank,
                *self._what,
                replace=replace,
            )
        except FileError as error:
            self._note.text = str(error)
            if not replace and (self._folder / self._name).exists():
                self._write.text = "Replace it"
            return
        except AlightError as error:
            self._note.text = str(error)
            return
        self._bench.log("saved", f"scenario {path}")
        self._tell(f"saved: {path}", "good")
        self._dialog.close()


def _told(answer: Answer, bench: Bench) -> tuple[str, str]:
    """What became of a command, and how good that is."""
    if answer.outcome is not Outcome.APPLIED:
        return f"refused: {answer.reason}", "bad"
    t = bench.time_of(answer.tick)
    at = "" if t is None else f", t = {shown(t)} s"
    return f"in force since tick {answer.tick}{at}", "good"
