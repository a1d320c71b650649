"""The page of the live bench: bar on top, display, panel on the right."""

from __future__ import annotations

import asyncio
from collections import deque
from typing import Any

from nicegui import ui

from alight.errors import AlightError
from alight.live.page import reports
from alight.live.page.bench import Bench
from alight.live.page.element import Plan, Scopes
from alight.live.page.parameters import Parameters, Pilot
from alight.live.page.preview import Effect, Preview
from alight.live.page.steering import Steering
from alight.live.page.widgets import Native, box, button, enable, html, switch
from alight.live.shared.commands import Kind
from alight.live.shared.status import State
from alight.simulation.closed_loop import ClosedLoop

REFRESH = 0.2
"""Time [s] between two looks at the bench; the display looks by itself, far more often."""
SETTLE = 0.12
"""Time [s] without another change after which the certificate of a draft is computed."""


class View:
    """One open page."""

    def __init__(self, bench: Bench, steering: Steering, preview: Preview, client: Any) -> None:
        self._bench, self._steering, self._preview = bench, steering, preview
        self._client = client
        self._wanted: ClosedLoop | None = None
        self._computing: asyncio.Task[None] | None = None
        self._shown_law: Any = None
        self._logged = -1
        with box("al-page"):
            self._top()
            self._banner_row()
            with box("al-display"):
                Plan()
                Scopes()
            with box("al-panel"):
                self.parameters = Parameters(
                    bench, Pilot(self.name, lambda: self.steers), self._on_draft
                )
                self._certificate = html("al-certificate")
                with box("al-low"):
                    self._host = html("al-host")
                    self._permitted = html("al-permitted")
                    self._log = html("al-log")
        ui.timer(REFRESH, self.refresh)
        self.refresh()

    # Who this is

    @property
    def name(self) -> str:
        """What the page goes by."""
        return self._steering.name(self._client.id)

    @property
    def steers(self) -> bool:
        """Whether this page steers."""
        return self._steering.steers(self._client.id)

    # The bar

    def _top(self) -> None:
        scenario = self._bench.scenario
        with box("al-top", "header"):
            with box("al-name"):
                Native("b", scenario.title).props["title"] = scenario.title
                Native("span", f"Alight live · {scenario.name}")
            self._badge = Native("div", "", "al-badge").props('role="status"')
            self._time = _cell("al-time", "run time")
            self._law = _cell("al-law text", "law in force")
            self._recording = _cell("al-rec text", "recorder")
            box("al-spring")
            self._steer = _cell("al-steer text", "")
            self._take = button("Take control", self._on_take, "small", "Steer from this page")
            with box("al-buttons"):
                self._start = button("Start", self._on_start, "go", "Begin a run")
                stop = button("STOP", self._on_stop, "", "Zero torque at once (Esc), from any page")
                stop.props["id"] = "stop"
                with stop:
                    Native("small", "Esc")
                self._reset = button("Reset", self._on_reset, "", "Back to the start of a run")
            theme = button("◐", lambda: None, "icon", "Light or dark")
            theme.on("click", js_handler="() => window.alightTheme()")

    def _banner_row(self) -> None:
        with box("al-banner al-hidden").props('role="alert"') as self._banner:
            self._banner_head, self._banner_text = Native("b"), Native("span")
            self._restart = button("Restart host", self._on_restart, "small")

    # Following the bench

    def refresh(self) -> None:
        """Show what is the case now."""
        bench, state = self._bench, self._bench.state
        self._show_state(state)
        self._show_banner()
        self._time[0].text = f"{bench.t:.2f} s"
        self._law[0].text = bench.bank.names[bench.in_force.law]
        self._show_recorder()
        self._show_steering()
        steers = self.steers and bench.alive
        enable(self._start, steers and state is State.READY)
        enable(self._reset, steers and state in (State.STOPPED, State.TRIPPED))
        self.parameters.refresh()
        if bench.in_force is not self._shown_law:
            self._shown_law = bench.in_force
            self._on_draft(self.parameters.draft.loop())
        self._host.content = reports.host(bench.health, bench.rate)
        permitted = () if bench.health is None else bench.health.scheduling
        self._permitted.content = reports.scheduling(permitted)
        if bench.told != self._logged:
            self._logged = bench.told
            self._log.content = reports.log(_last(bench.lines, 120))

    def _show_state(self, state: State | None) -> None:
        health = self._bench.health
        name = "STARTING" if health is None else "HOST DEAD" if state is None else state.name
        kind = "dead" if name == "HOST DEAD" else name.lower()
        self._badge.text = name
        self._badge.classes(replace=f"al-badge {kind}")
        self._time[1].text = "run time" if state is State.RUNNING else "time"

    def _show_banner(self) -> None:
        bench = self._bench
        head, text, note = "", "", False
        if bench.health is not None and not bench.alive:
            head = "HOST NOT RUNNING"
            text = f"last sign of life {bench.health.silent:.1f} s ago; {_safe(bench)}"
            if bench.restarting:
                text += "; another host has been asked for"
        elif bench.state is State.TRIPPED and bench.health is not None:
            head, text = "TRIPPED", f"{bench.health.reason}. Torques are zero until a reset."
        if not bench.supervised:
            gone = "the supervisor is gone: nothing is started anew; start alight live again"
            head, text, note = head or "SUPERVISOR GONE", reports.joined((text, gone)), not head
        switch(self._banner, "al-hidden", not head)
        switch(self._banner, "note", note)
        self._banner_head.text, self._banner_text.text = head, text
        dead = bench.health is not None and not bench.alive
        switch(self._restart, "al-hidden", not dead)
        enable(self._restart, self.steers and bench.supervised and not bench.restarting)

    def _show_recorder(self) -> None:
        head, below, kind = reports.recorder(self._bench.recorder)
        self._recording[0].text, self._recording[1].text = head, below
        self._recording[2].classes(replace=f"al-cell al-rec text {kind}")
        self._recording[2].props["title"] = reports.joined((head, below))

    def _show_steering(self) -> None:
        watching = self._steering.watching - (not self.steers)
        others = f"{watching} watching" if watching else "no other page"
        head = "You steer" if self.steers else "Watching"
        below = others if self.steers else f"{self._steering.holder or 'nobody'} steers"
        self._steer[0].text, self._steer[1].text = head, below
        switch(self._take, "al-hidden", self.steers)

    # The certificate

    def _on_draft(self, loop: ClosedLoop | None) -> None:
        self._wanted = loop
        if self._computing is None or self._computing.done():
            self._computing = asyncio.create_task(self._compute())
        switch(self._certificate, "old", True)

    async def _compute(self) -> None:
        """The certificates of what is in force and of the draft, until no newer one is wanted."""
        done: Any = None
        while done is None or done != (self._bench.in_force.loop, self._wanted):
            await asyncio.sleep(SETTLE)
            done = (self._bench.in_force.loop, self._wanted)
            effects: list[Effect | None] = []
            for loop in done:
                same = loop is None or (effects and loop.law == done[0].law)
                of = self._preview.of
                effects.append(None if same else await asyncio.to_thread(of, loop.law))
        if self._client.is_deleted:
            return
        with self._client:
            self._certificate.content = reports.certificate(effects[0], effects[1])
            switch(self._certificate, "old", self._wanted is None)

    # What is asked for

    def _on_take(self) -> None:
        self._steering.take(self._client.id)
        self.refresh()

    async def _on_start(self) -> None:
        await self._ask(Kind.START)

    async def _on_stop(self) -> None:
        # From any page: whoever sees that something goes wrong must be able to stop it.
        await self._ask(Kind.STOP, anybody=True)

    async def _on_reset(self) -> None:
        await self._ask(Kind.RESET)

    async def _ask(self, kind: Kind, *, anybody: bool = False) -> None:
        if not (anybody or self.steers):
            return
        try:
            await self._bench.submit(kind, self.name)
        except AlightError as error:
            self._bench.log("refused", f"{kind.name.lower()}: {error}", self.name)
        self.refresh()

    def _on_restart(self) -> None:
        if not self.steers:
            return
        try:
            self._bench.ask_for_host(self.name)
        except AlightError as error:
            self._bench.log("refused", f"restart host: {error}", self.name)
        self.refresh()


def _safe(bench: Bench) -> str:
    """Why nothing moves without a host."""
    if bench.session.settings.device is None:
        return "the simulated plant has stopped with it; real drives are safe by their own watchdog"
    return "the drives are safe by their own watchdog"


def _cell(classes: str, key: str) -> tuple[Native, Native, Any]:
    with box(f"al-cell {classes}") as outer:
        head, below = Native("b"), Native("span", key, "k")
    return head, below, outer


def _last(lines: deque[Any], most: int) -> list[Any]:
    return list(lines)[-most:]
