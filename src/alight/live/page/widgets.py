"""Small parts of the page: native elements with text, and a field for a number."""

from __future__ import annotations

from collections.abc import Callable
from html import escape
from typing import Any

from nicegui import ui
from nicegui.element import Element
from nicegui.elements.mixins.text_element import TextElement

from alight.live.page.fields import Field

HAND = 100.0
"""A slider reaches this many times below and above the value of the scenario."""


class Native(TextElement):
    """An element of HTML with a text."""

    def __init__(self, tag: str, text: str = "", classes: str = "") -> None:
        super().__init__(tag=tag, text=text)
        if classes:
            self.classes(classes)


def box(classes: str, tag: str = "div") -> Element:
    """An element to put others into."""
    return ui.element(tag).classes(classes)


def html(classes: str) -> ui.html:
    """An element whose content is HTML made here, every foreign text in it escaped."""
    return ui.html("", sanitize=False).classes(classes)


def switch(element: Element, name: str, on: bool) -> None:
    """Give an element a class, or take it away; nothing is sent if it stays as it is."""
    if (name in element.classes) != on:
        element.classes(add=name) if on else element.classes(remove=name)


def enable(element: Element, on: bool) -> None:
    """Let a button or field be used, or not."""
    if ("disabled" in element.props) == on:
        element.props(remove="disabled") if on else element.props("disabled")


def put(element: Element, **values: str) -> None:
    """Set attributes; nothing is sent if they stay as they are."""
    changed = {name: value for name, value in values.items() if element.props.get(name) != value}
    if changed:
        element.props.update(changed)


def button(text: str, act: Callable[[], Any], classes: str = "", hint: str = "") -> Native:
    """A button."""
    made = Native("button", text, classes)
    made.props["type"] = "button"
    if hint:
        made.props["title"] = hint
    made.on("click", lambda _: act(), args=[])
    return made


class NumberField(Element):
    """Symbol, slider, field and unit of one number."""

    def __init__(self, item: Field, nominal: float, typed: Callable[[Field, str], None]) -> None:
        super().__init__("alight-field")
        self.item = item
        low, high, scale = _reach(item, nominal)
        self._revision = 0
        self.props.update(
            {
                "id": f"field-{item.key.replace('.', '-')}",
                "symbol": item.symbol,
                "index": "" if item.entry is None else str(item.entry + 1),
                "unit": _printed(item.quantity.unit),
                "meaning": item.meaning,
                "from": repr(low),
                "to": repr(high),
                "scale": scale,
            }
        )
        self.on(
            "draft",
            lambda event: typed(item, str(event.args)[:64]),
            js_handler="(event) => emit(event.detail)",
            throttle=0.05,
        )

    def show(self, now: float, draft: str, problem: str, *, locked: bool, renew: bool) -> None:
        """Show the value in force, the draft, and what is wrong with it."""
        self._revision += renew
        put(
            self,
            now=f"{now:.6g}",
            draft=draft,
            problem=problem,
            locked="yes" if locked else "no",
            revision=str(self._revision),
        )


def _reach(item: Field, nominal: float) -> tuple[float, float, str]:
    """Ends of a slider, and its scale."""
    bounds = item.bounds
    if bounds.lower is not None and bounds.upper is not None:
        return bounds.lower, bounds.upper, "linear"
    if bounds.lower == 0 and nominal > 0:
        return nominal / HAND, nominal * HAND, "log"
    span = max(0.25 * abs(nominal), 1e-3)
    return nominal - span, nominal + span, "linear"


def _printed(unit: str) -> str:
    """A unit with its exponents raised."""
    return "" if unit == "mixed" else unit.replace("^2", "²").replace("^3", "³")


def safe(text: object) -> str:
    """Text for HTML."""
    return escape(str(text), quote=True)
