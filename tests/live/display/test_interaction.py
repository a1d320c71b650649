"""The display under the hands of a person: time, cursors, scopes; other hosts, recordings."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import alight
from alight.live.replay import ReplaySource
from tests.live.display.feed import RATE, Feed
from tests.live.display.looking import PLACE, SAID, column, drawn, here, struck


def test_a_cursor_tells_the_values_of_all_scopes(feed: Feed, look: Callable) -> None:
    struck(feed)
    page = look(lambda: feed.source)
    here(page, feed.ring.head)
    page.evaluate("alight.timeline.pause(); alight.timeline.zoom(1)")
    drawn(page)
    box = page.locator("alight-scopes canvas").bounding_box()
    assert box is not None
    rows = []
    for wanted in (1200, 1350):
        place = page.evaluate(PLACE, ["F_m", wanted])
        page.mouse.click(box["x"] + place["at"], box["y"] + place["y"] + 20)
        rows.append(page.evaluate("alight.timeline.cursors.filter((r) => r !== null).at(-1)"))
        assert abs(rows[-1] - wanted) <= 2 * 1.0 * RATE / place["w"]
    page.mouse.move(5, 5)
    drawn(page)
    assert page.evaluate("alight.timeline.shown") == rows[0]
    force = feed.column("F_m").astype(np.float32)[rows[0]]
    factor = page.evaluate("look.strip('F_m').factor")
    shown = page.evaluate(SAID, ["F_m", rows[0]])[0].replace("−", "-")
    digits = len(shown.partition(".")[2])
    assert float(shown) == pytest.approx(force / factor, abs=0.51 * 10**-digits)
    words = page.locator("alight-scopes .told").inner_text()
    start = int(np.argmax(feed.column("state") == 1))
    assert f"A {(rows[0] - start) / RATE:.4f} s" in words
    assert f"Δt {(rows[1] - rows[0]) * 1000 / RATE:.1f} ms" in words


def test_pause_freezes_the_picture_and_loses_nothing(feed: Feed, look: Callable) -> None:
    struck(feed)
    page = look(lambda: feed.source)
    here(page, feed.ring.head)
    page.keyboard.press(" ")
    drawn(page)
    before = page.evaluate("look.picture()")
    feed.tick(RATE)
    here(page, feed.ring.head)  # it goes on listening
    assert page.evaluate("look.picture()") == before
    page.keyboard.press(" ")
    drawn(page)
    assert page.evaluate("look.picture()") != before
    assert page.evaluate("alight.timeline.right") == feed.ring.head
    np.testing.assert_array_equal(column(page, "e_m"), feed.column("e_m").astype(np.float32))


def test_a_hidden_page_misses_nothing_although_its_timers_sleep(feed: Feed, look: Callable) -> None:
    struck(feed)
    page = look(lambda: feed.source)
    here(page, feed.ring.head)
    page.evaluate("Object.defineProperty(document, 'hidden', { get: () => true })")
    page.evaluate("globalThis.setTimeout = () => {}")
    for _ in range(3):
        feed.tick(RATE)
        page.wait_for_function("(row) => alight.bench.history.end >= row", arg=feed.ring.head)
    assert page.evaluate("alight.bench.stats.skipped") == 0


def test_another_host_is_followed_from_its_first_row(
    feed: Feed, tmp_path: Path, look: Callable
) -> None:
    struck(feed)
    sources = [feed.source]
    page = look(lambda: sources[-1])
    here(page, feed.ring.head)
    other = Feed(tmp_path / "host-2")
    other.tick(250)
    sources.append(other.source)
    page.wait_for_function(
        "alight.bench.layout.generation === 2 && alight.bench.history.end === 250"
    )
    np.testing.assert_array_equal(column(page, "busy"), other.column("busy").astype(np.float32))


def test_keys_and_buttons_move_the_window(feed: Feed, look: Callable) -> None:
    struck(feed)
    page = look(lambda: feed.source)
    here(page, feed.ring.head)
    page.keyboard.press("+")
    assert page.evaluate("alight.timeline.span") == 5
    page.get_by_role("button", name="longer window").click()
    assert page.evaluate("alight.timeline.span") == 10
    page.get_by_role("combobox", name="window").select_option("0.05")
    assert page.evaluate("alight.timeline.span") == 0.05
    page.locator("alight-scopes canvas").focus()
    page.keyboard.press("ArrowLeft")
    assert page.evaluate("alight.timeline.right") == feed.ring.head - 10
    page.keyboard.press("End")
    assert page.evaluate("alight.timeline.right") == feed.ring.head
    box = page.locator("alight-scopes canvas").bounding_box()
    assert box is not None
    drawn(page)
    place = page.evaluate(PLACE, ["e_r", feed.ring.head - 50])
    page.mouse.move(box["x"] + place["at"], box["y"] + place["y"] + 30)
    page.mouse.wheel(0, 100)
    assert page.evaluate("alight.timeline.span") == pytest.approx(0.06)


def test_scopes_are_chosen_and_enlarged(feed: Feed, look: Callable) -> None:
    struck(feed)
    page = look(lambda: feed.source)
    shown = "document.querySelector('alight-scopes').shown.map((s) => s.spec.id)"
    here(page, feed.ring.head)
    everything = page.evaluate(shown)
    assert len(everything) == 10
    page.get_by_text("Scopes ▾").click()
    page.get_by_role("checkbox", name="Lyapunov V_r").uncheck()
    assert page.evaluate(shown) == [name for name in everything if name != "V_r"]
    page.get_by_role("checkbox", name="Lyapunov V_r").check()
    for expected in (["F_m"], everything, ["F_m"]):
        page.get_by_role("button", name="enlarge contact force").click()
        drawn(page)
        assert page.evaluate(shown) == expected
    page.keyboard.press("c")
    assert page.evaluate(shown) == everything


def test_the_plan_shows_the_pose_at_the_cursor(feed: Feed, look: Callable) -> None:
    struck(feed)
    page = look(lambda: feed.source)
    here(page, feed.ring.head)
    page.evaluate("alight.timeline.pause(); alight.timeline.place(0, 1100)")
    posed = "document.querySelector('alight-plan').posed"
    page.wait_for_function(f"{posed}?.row === 1100")
    pose = page.evaluate(posed)
    for name, value in {"x_r1": pose["tip"][0], "x_r2": pose["tip"][1], "x_m": pose["x_m"]}.items():
        assert value == pytest.approx(feed.column(name)[1100], abs=1e-6)
    assert pose["x_md"] == pytest.approx(feed.scenario.target.x_md, abs=1e-6)
    assert pose["touch"] == bool(feed.column("Lambda")[1100])


def test_a_recording_plays_and_is_sought_in(look: Callable) -> None:
    scenario = alight.load_scenario("experiment-1", {"duration": 2.5})
    recording = alight.simulate(scenario, backend="vm")
    source = ReplaySource(recording)
    source.seek(2 * RATE)
    page = look(lambda: source)
    here(page, 2 * RATE)
    np.testing.assert_array_equal(column(page, "F_m"), recording["F_m"][: 2 * RATE].astype("<f4"))
    source.seek(1000)
    page.wait_for_function("alight.bench.end === 1000")
    assert page.evaluate("alight.timeline.right") == 1000
    source.seek(4800)
    page.wait_for_function("alight.bench.end === 4800")
    np.testing.assert_array_equal(column(page, "e_m"), recording["e_m"][:4800].astype("<f4"))


def test_a_pointer_at_rest_tells_what_runs_by_beneath_it(feed: Feed, look: Callable) -> None:
    struck(feed)
    page = look(lambda: feed.source)
    here(page, feed.ring.head)
    box = page.locator("alight-scopes canvas").bounding_box()
    assert box is not None
    place = page.evaluate(PLACE, ["e_m", feed.ring.head - 400])
    page.mouse.move(box["x"] + place["at"], box["y"] + place["y"] + 20)
    drawn(page)
    before = page.evaluate("alight.timeline.shown")
    feed.tick(1000)
    here(page, feed.ring.head)
    assert page.evaluate("alight.timeline.shown") == before + 1000
    page.mouse.move(2, 2)
    drawn(page)
    assert page.evaluate("alight.timeline.shown") == feed.ring.head - 1
