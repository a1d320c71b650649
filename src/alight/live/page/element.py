"""The display's elements, as NiceGUI places them; what they show they fetch by themselves."""

from __future__ import annotations

from nicegui import ui
from nicegui.element import Element

from alight.live.page.stream import STATIC_PATH


class Plan(Element):
    """Plan view of arm, body and contact; fills the box that it is given."""

    def __init__(self) -> None:
        super().__init__("alight-plan")


class Scopes(Element):
    """Strip charts of all signals; fills the box that it is given.

    Parameters
    ----------
    hotkeys : bool
        Whether it listens to the keys of the whole page: space, plus, minus, arrows.
    """

    def __init__(self, *, hotkeys: bool = True) -> None:
        super().__init__("alight-scopes")
        if hotkeys:
            self.props("hotkeys")


def add_display_head() -> None:
    """Add what the elements need to the head of the page that is being built."""
    ui.add_head_html(
        f'<link rel="stylesheet" href="{STATIC_PATH}/bench.css">'
        f'<script type="module" src="{STATIC_PATH}/bench.js"></script>'
    )
