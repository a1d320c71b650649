"""The page on a recording: the same display, with transport in place of start and stop."""

from __future__ import annotations

import asyncio
import os
import tempfile
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from nicegui import Client, app, ui

from alight.errors import AlightError
from alight.live.bank import Bank, with_parameters
from alight.live.page import reports
from alight.live.page.element import Plan, Scopes
from alight.live.page.fields import fields_of
from alight.live.page.live import add_head, connected
from alight.live.page.news import Line
from alight.live.page.parameters import TABS
from alight.live.page.preview import Preview
from alight.live.page.serve import address, listen, make_app, quiet, serve
from alight.live.page.stream import mount_stream
from alight.live.page.widgets import Native, NumberField, box, button, html, put, switch
from alight.live.replay import ReplaySource
from alight.live.shared.status import State
from alight.simulation.closed_loop import ClosedLoop
from alight.simulation.recording_events import EventKind

REFRESH = 0.2
CHANGES = (EventKind.GAINS, EventKind.TARGET, EventKind.LAW)
"""Events that carry every parameter of a law."""
SPEEDS = (0.01, 0.1, 0.25, 0.5, 1.0, 2.0, 5.0, 20.0)


class Played:
    """A recording, and what was in force at each of its rows."""

    def __init__(self, source: ReplaySource) -> None:
        self.source = source
        self.preview = Preview(source.scenario)
        try:
            self.bank: Bank | None = Bank.of(source.scenario)
        except AlightError:
            self.bank = None
        self.lines = [
            Line(i, 0.0, event.t, event.kind, event.text, row=event.row)
            for i, event in enumerate(source.recording.events)
        ]

    @property
    def row(self) -> int:
        """The row that is shown last."""
        return max(self.source.head - 1, self.source.first)

    def now(self) -> dict[str, float]:
        """What the last row says of time and state."""
        _, rows = self.source.read(self.row, 1)
        places = self.source.layout.slices()
        names = [name for name in ("t", "state") if name in places]
        return {name: float(rows[0, places[name]][0]) for name in names} if len(rows) else {}

    def loop_at(self, row: int) -> ClosedLoop | None:
        """The closed loop with the law and parameters in force at a row; None if unknown."""
        if self.bank is None:
            return None
        changes = [e for e in self.source.recording.events if e.kind in CHANGES and e.row <= row]
        name = self.source.law_at(row)
        if name not in self.bank.number_of:
            return None
        loop = self.bank.loops[self.bank.number_of[name]]
        return with_parameters(loop, np.array(changes[-1].values)) if changes else loop


class ReplayView:
    """One open page on a recording."""

    def __init__(self, played: Played, client: Client) -> None:
        self._played, self._source, self._client = played, played.source, client
        self._fields: list[NumberField] = []
        self._loop: ClosedLoop | None = None
        self._computing: asyncio.Task[None] | None = None
        with box("al-page"):
            self._top()
            with box("al-display"):
                Plan()
                Scopes()
            with box("al-panel"):
                self._panel()
        ui.timer(REFRESH, self.refresh)
        self.refresh()

    def _top(self) -> None:
        scenario, recording = self._source.scenario, self._source.recording
        with box("al-top", "header"):
            with box("al-name"):
                Native("b", scenario.title).props["title"] = scenario.title
                Native("span", f"Alight replay · {scenario.name}")
            self._badge = Native("div", "", "al-badge").props('role="status"')
            with box("al-cell al-time"):
                self._t = Native("b")
                Native("span", "time", "k")
            with box("al-cell al-law text"):
                self._law = Native("b")
                Native("span", "law in force", "k")
            with box("al-transport"):
                self._play = button("Play", self._on_play, "primary", "Play or pause")
                with ui.element("select").props('aria-label="Speed"') as speed:
                    for value in SPEEDS:
                        option = Native("option", f"{value:g} ×")
                        option.props["value"] = repr(value)
                        if value == 1.0:
                            option.props("selected")
                speed.on("change", self._on_speed, js_handler="(e) => emit(e.target.value)")
                self._seek = ui.element("alight-seek")
                self._seek.on(
                    "seek", self._on_seek, js_handler="(e) => emit(e.detail)", throttle=0.1
                )
            with box("al-cell al-end text"):
                Native("b", _told(recording.verdict.outcome))
                Native("span", f"{len(recording)} samples", "k")
            theme = button("◐", lambda: None, "icon", "Light or dark")
            theme.on("click", js_handler="() => window.alightTheme()")

    def _panel(self) -> None:
        with box("al-tabs"):
            self._tabs = {n: button(n, partial(self._choose, n)) for n in TABS}
        with box("al-fields al-read"):
            self._contents = {name: box("") for name in TABS}
        self._choose("Gains")
        self._certificate = html("al-certificate")
        with box("al-low"):
            Native("h2", "Events, click to go there", "al-head")
            log = html("al-log")
            log.content = reports.log(self._played.lines[::-1])
            log.on(
                "click",
                self._on_seek,
                js_handler="(event) => { const line = event.target.closest('[data-seek]'); "
                "if (line) emit(Number(line.dataset.seek)); }",
            )

    def _choose(self, name: str) -> None:
        for other, tab in self._tabs.items():
            switch(tab, "on", other == name)
            switch(self._contents[other], "al-hidden", other != name)

    def refresh(self) -> None:
        """Show where the recording stands."""
        source, now = self._source, self._played.now()
        state = State(int(now["state"])).name if "state" in now else "RECORDED"
        self._badge.text = state
        self._badge.classes(replace=f"al-badge {state.lower()}")
        self._t.text = f"{now.get('t', 0.0):.3f} s"
        self._play.text = "Pause" if source.playing else "Play"
        put(
            self._seek,
            first=str(source.first),
            rows=str(source.rows),
            at=str(source.head),
            dt=repr(source.dt),
        )
        self._law.text = source.law_at(self._played.row)
        loop = self._played.loop_at(self._played.row)
        if loop is not None and (self._loop is None or loop.law != self._loop.law):
            self._show_law(loop)

    def _show_law(self, loop: ClosedLoop) -> None:
        if self._loop is None or type(self._loop.law) is not type(loop.law):
            for name, paths in TABS.items():
                self._contents[name].clear()
                with self._contents[name]:
                    made = [
                        NumberField(f, f.of(loop), lambda *_: None) for f in fields_of(loop, *paths)
                    ]
                    if not made:
                        Native("div", "This law has none of these.", "al-say")
                self._fields = [f for f in self._fields if not f.is_deleted] + made
        self._loop = loop
        for field in self._fields:
            field.show(field.item.of(loop), "", "", locked=True, renew=True)
        if self._computing is None or self._computing.done():
            self._computing = asyncio.create_task(self._compute())

    async def _compute(self) -> None:
        """The certificate of what was in force, until nothing newer is shown."""
        done = None
        while done is not self._loop and self._loop is not None:
            done = self._loop
            effect = await asyncio.to_thread(self._played.preview.of, done.law)
        if not self._client.is_deleted:
            self._certificate.content = reports.certificate(effect, None, "Certificate")

    def _on_play(self) -> None:
        if self._source.playing:
            self._source.pause()
        else:
            self._source.play()
        self.refresh()

    def _on_speed(self, event: Any) -> None:
        try:
            self._source.speed = float(event.args)
        except (TypeError, ValueError):
            return

    def _on_seek(self, event: Any) -> None:
        if isinstance(event.args, (int, float)) and abs(event.args) < 2**53:
            self._source.seek(int(event.args) + 1)
            self.refresh()


def _told(outcome: Any) -> str:
    """The outcome of a recorded run in few words."""
    return str(getattr(outcome, "name", outcome)).replace("_", " ").lower()


def serve_replay(path: Path, port: int) -> None:
    """Show a recording on the page, on this machine, until interrupted.

    Raises
    ------
    AlightError
        If the file is no recording, or the port is taken.
    """
    quiet()
    played = Played(ReplaySource(path))
    socket = listen("127.0.0.1", port)
    with tempfile.TemporaryDirectory(prefix="alight-") as folder:
        os.environ["NICEGUI_STORAGE_PATH"] = folder
        made = make_app(f"Alight replay: {Path(path).name}")
        mount_stream(app, lambda: played.source)

        @ui.page("/")
        async def page(client: Client) -> None:
            add_head()
            if await connected(client):
                ReplayView(played, client)

        serve(made, socket, None, lambda: print(f"page  {address(socket)}", flush=True))
