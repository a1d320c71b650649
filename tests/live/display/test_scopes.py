"""The display in a real browser: what it holds, draws and says is what the ring holds."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from alight.live.bank import parameter_column
from alight.live.shared.commands import Kind
from tests.live.display.feed import RATE, Feed
from tests.live.display.looking import OFF, column, drawn, here, struck


def test_the_browser_holds_every_row_of_the_ring(feed: Feed, look: Callable) -> None:
    struck(feed)
    page = look(lambda: feed.source)
    for count in (1, 333, 2 * RATE):
        feed.tick(count)
        page.wait_for_timeout(30)
    here(page, feed.ring.head)
    for name in ("e_r1", "torque2", "F_m", "theta_r_hat5", "V_r", "late", "probe_clearance"):
        got = column(page, name)
        assert len(got) == feed.ring.head
        np.testing.assert_array_equal(got, feed.column(name).astype(np.float32), err_msg=name)
    assert page.evaluate("alight.bench.stats.skipped") == 0


@pytest.mark.parametrize("span", [0.5, 10, 60, 600])
def test_a_spike_of_one_tick_is_drawn(feed: Feed, look: Callable, span: float) -> None:
    feed.tick(400)
    feed.tick(1, spike=0.02)
    feed.tick(400)
    page = look(lambda: feed.source)
    here(page, feed.ring.head)
    page.evaluate("(span) => alight.timeline.zoom(span)", span)
    drawn(page)
    late = feed.column("late")
    spike = int(np.argmax(late))
    # At the top, and half way up: the stroke goes all the way.
    for part in (0.97, 0.5):
        assert page.evaluate(OFF, ["timing", spike, float(late[spike]) * part, 2]) < 60
    away = spike - max(60, int(span * RATE / 40))
    assert page.evaluate(OFF, ["timing", away, float(late[spike]) * 0.5, 2]) > 60


def test_what_was_skipped_is_a_gap(tmp_path: Path, look: Callable) -> None:
    feed = Feed(tmp_path / "short", seconds=1.0)
    feed.tick(600)
    page = look(lambda: feed.source)
    here(page, 600)
    # The page is busy for as long as the ring takes to go round.
    page.evaluate("alight.bench._say = () => {}")
    page.wait_for_timeout(100)
    feed.tick(3 * RATE)
    page.evaluate("delete alight.bench._say, alight.bench._say({ next: alight.bench.history.end })")
    here(page, feed.ring.head)
    skipped = page.evaluate("alight.bench.stats.skipped")
    got = column(page, "late")
    assert skipped > RATE
    assert len(got) == feed.ring.head
    assert np.flatnonzero(np.isnan(got)).tolist() == list(range(600, 600 + skipped))
    kept = feed.column("late").astype(np.float32)
    np.testing.assert_array_equal(got[-1000:], kept[-1000:])


def test_marks_stand_where_things_happened(feed: Feed, look: Callable) -> None:
    struck(feed)
    page = look(lambda: feed.source)
    changed = feed.gains(k1=1.25)
    feed.tick(200)
    feed.ask(Kind.STOP)
    feed.tick(200)
    here(page, feed.ring.head)
    page.wait_for_function("alight.bench.marks.list.length >= 3")
    marks = {m["label"]: m["row"] for m in page.evaluate("alight.bench.marks.list")}
    state = feed.column("state")
    assert marks["start"] == int(np.argmax(state == 1))
    assert marks["k1 = 1.25"] == feed.link.commands.answer(changed).tick
    assert marks["stop"] == len(state) - int(np.argmax(state[::-1] != 2))
    touch = np.diff(np.concatenate([[0.0], feed.column("Lambda")]))
    begins = [a for a, _ in page.evaluate("alight.bench.marks.contacts")]
    assert begins == np.flatnonzero(touch > 0).tolist()
    assert len(begins) > 0


def test_a_trip_is_marked_at_its_row_with_its_reason(feed: Feed, look: Callable) -> None:
    struck(feed)
    page = look(lambda: feed.source)
    feed.ask(Kind.KICK, [240.0, 20.0, 0.5])
    feed.tick(RATE)
    here(page, feed.ring.head)
    tripped = feed.column("state") == 3
    assert tripped.any()
    page.wait_for_function("alight.bench.marks.list.some((mark) => mark.full)")
    mark = page.evaluate("alight.bench.marks.list.find((mark) => mark.kind === 'trip')")
    assert mark["label"] == "TRIP"
    assert mark["row"] == int(np.argmax(tripped))
    assert mark["full"] == feed.cycle.reason


def test_a_law_without_a_signal_leaves_a_gap(feed: Feed, look: Callable) -> None:
    struck(feed)
    page = look(lambda: feed.source)
    number = feed.bank.number_of["exact-model"]
    feed.ask(Kind.LAW, parameter_column(feed.bank.loops[number]), law=number)
    feed.tick(400)
    here(page, feed.ring.head)
    assert np.isnan(column(page, "theta_r_hat1")[-300:]).all()
    assert np.isfinite(column(page, "e_r1")).all()
