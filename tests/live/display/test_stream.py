"""Telemetry on the wire: complete, paced by its reader, and deaf to nonsense."""

from __future__ import annotations

import json
import logging
import struct
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect

from alight.live.page.drawn import DRAWN
from alight.live.page.stream import LAG, LAYOUT_PATH, PATIENCE, SECONDS, SOCKET_PATH
from alight.live.shared.commands import Kind
from alight.symbolic.signals import Layout
from tests.live.display.feed import RATE, Feed
from tests.live.display.served import Server, serve

HEAD = struct.Struct("<ddII")
NAMES = ["t", "e_r1", "torque2", "V_r"]


@pytest.fixture
def server(feed: Feed) -> Iterator[Server]:
    feed.tick(500)
    with serve(lambda: feed.source, most=8) as served:
        yield served


@pytest.fixture(scope="module")
def still(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server whose bench has 500 rows and gets no more."""
    feed = Feed(tmp_path_factory.mktemp("still") / "host-1")
    feed.tick(500)
    with serve(lambda: feed.source, most=8) as served:
        yield served


def joined(server: Server) -> ClientConnection:
    return connect(
        server.url.replace("http", "ws") + SOCKET_PATH,
        compression=None,
        max_size=None,
        close_timeout=1,
    )


def rows_of(message: bytes) -> tuple[int, int, np.ndarray]:
    first, head, count, width = HEAD.unpack_from(message)
    columns = np.frombuffer(message, "<f4", offset=HEAD.size).reshape(width, count)
    return int(first), int(head), columns.T


def ask(socket: ClientConnection, **message: Any) -> tuple[int, int, np.ndarray]:
    """The rows that answer a message; events that come before them are left out."""
    socket.send(json.dumps(message))
    while isinstance(answer := socket.recv(timeout=30), str):
        assert "event" in answer
    return rows_of(answer)


def expected(feed: Feed, first: int, last: int) -> np.ndarray:
    start, rows = feed.ring.read(first, last - first)
    assert start == first
    picked = [feed.link.layout.columns.index(name) for name in NAMES]
    return rows[:, picked].astype(np.float32)


def test_every_row_arrives_once_and_equals_the_ring(feed: Feed, server: Server) -> None:
    feed.ask(Kind.START)
    with joined(server) as socket:
        got = [ask(socket, columns=NAMES, since=0)]
        for count in (1, 0, 700, 37):
            if count:
                feed.tick(count)
            got.append(ask(socket, next=got[-1][0] + len(got[-1][2])))
    values = np.concatenate([rows for _, _, rows in got])
    assert [first for first, _, _ in got] == [0, 500, 501, 501, 1201]
    assert len(values) == got[-1][1] == feed.ring.head
    np.testing.assert_array_equal(values, expected(feed, 0, feed.ring.head))


def test_a_message_carries_two_seconds_at_most(feed: Feed, server: Server) -> None:
    feed.tick(3 * RATE)
    with joined(server) as socket:
        first, head, rows = ask(socket, columns=NAMES, since=100)
    assert (first, head, len(rows)) == (100, feed.ring.head, SECONDS * RATE)


def test_what_the_ring_has_lost_shows_as_a_later_first_row(tmp_path: Path) -> None:
    feed = Feed(tmp_path / "host-1", seconds=0.5)
    feed.tick(10)
    with serve(lambda: feed.source) as server, joined(server) as socket:
        assert ask(socket, columns=NAMES, since=0)[0] == 0
        feed.tick(3 * RATE)
        first, head, rows = ask(socket, next=10)
    assert head - first == len(rows) > 0.4 * RATE
    assert first == feed.ring.read(0)[0]
    np.testing.assert_array_equal(rows, expected(feed, first, head))


def test_a_reader_that_falls_ever_further_behind_is_brought_to_the_present(
    feed: Feed, server: Server
) -> None:
    feed.tick(int(LAG * RATE) + 100)
    with joined(server) as socket:
        ask(socket, columns=NAMES, since=7)
        answers = []
        for _ in range(PATIENCE):
            feed.tick(1)
            answers.append(ask(socket, next=7)[:2])
    *before, (first, head) = answers
    assert {first for first, _ in before} == {7}
    assert head - first == SECONDS * RATE


def test_the_layout_tells_names_units_geometry_and_limits(feed: Feed, server: Server) -> None:
    told = httpx.get(server.url + LAYOUT_PATH).json()
    layout, scenario = Layout({**feed.link.layout.signals, **DRAWN}), feed.scenario
    assert [c["name"] for c in told["columns"]] == list(layout.columns)
    assert [c["unit"] for c in told["columns"]] == list(layout.units)
    assert told["dt"] == 1 / RATE
    assert told["geometry"]["l1"] == scenario.plant.arm.l1
    assert told["limits"]["torque2"] == {"lower": -20.0, "upper": 20.0}
    assert told["limits"]["probe_clearance"] == {"lower": 0.0, "upper": None}
    box = told["boxes"]["theta_r_hat3"]
    assert box == [scenario.law.theta_r.lower[2], scenario.law.theta_r.upper[2]]


def test_events_are_told_once_each_with_its_row(feed: Feed, server: Server) -> None:
    events = []
    with joined(server) as socket:
        socket.send(json.dumps({"columns": ["t"], "since": 0}))
        socket.recv()
        feed.ask(Kind.START)
        feed.tick(20)
        changed = feed.gains(k1=1.25)
        feed.tick(20)
        for row in (500, 510, 540):
            socket.send(json.dumps({"next": row}))
            while isinstance(answer := socket.recv(timeout=30), str):
                events.append(json.loads(answer)["event"])
    assert [event["kind"] for event in events] == ["start", "gains"]
    assert events[1]["changes"] == {"law.gains.k1": 1.25}
    assert events[1]["row"] == feed.link.commands.answer(changed).tick


@pytest.mark.parametrize(
    "nonsense",
    [
        "no json",
        "[1, 2]",
        '"' + "x" * 20000 + '"',
        b"\x00\x01",
        '{"hello": 1}',
        '{"columns": "t"}',
        '{"columns": [1]}',
        '{"columns": ["no_such"]}',
        '{"columns": ["t"], "since": -1}',
        '{"columns": ["t"], "since": 1e99}',
        '{"columns": ["t"], "since": true}',
        "[" * 9000,
    ],
)
def test_nonsense_closes_its_own_socket_only(
    still: Server, nonsense: str | bytes, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.WARNING, "alight.live.page.stream")
    with joined(still) as good, joined(still) as bad:
        ask(good, columns=NAMES, since=0)
        bad.send(nonsense)
        with pytest.raises(ConnectionClosed) as closed:
            bad.recv(timeout=30)
        assert closed.value.rcvd is not None
        assert closed.value.rcvd.code in (1008, 1009)
        assert closed.value.rcvd.reason
        assert ask(good, next=500)[1] == 500
    assert len(caplog.records) == 1


def test_one_display_too_many_is_told_so(still: Server) -> None:
    with ExitStack() as stack:
        sockets = [stack.enter_context(joined(still)) for _ in range(8)]
        for socket in sockets:
            ask(socket, columns=["t"], since=0)
        with joined(still) as late, pytest.raises(ConnectionClosed) as closed:
            late.recv(timeout=30)
        for socket in sockets:
            assert ask(socket, next=0)[1] == 500
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == 1013
    assert "8 displays" in closed.value.rcvd.reason


def test_a_reader_that_does_not_read_holds_nobody_up(feed: Feed, server: Server) -> None:
    feed.tick(2 * RATE)
    everything = list(feed.link.layout.columns)
    with joined(server) as slow, joined(server) as quick:
        slow.send(json.dumps({"columns": everything, "since": 0}))
        for _ in range(200):
            slow.send(json.dumps({"next": 0}))  # 200 times 1.5 MB that it never takes
        got = [ask(quick, columns=NAMES, since=0)]
        for _ in range(20):
            feed.tick(10)
            got.append(ask(quick, next=got[-1][0] + len(got[-1][2])))
    assert got[-1][1] == feed.ring.head


def test_another_host_makes_the_client_start_over(feed: Feed, tmp_path: Path) -> None:
    feed.tick(10)
    sources = [feed.source]
    with serve(lambda: sources[-1]) as server, joined(server) as socket:
        before = httpx.get(server.url + LAYOUT_PATH).json()["generation"]
        ask(socket, columns=NAMES, since=0, generation=before)
        other = Feed(tmp_path / "host-2")
        other.tick(3)
        sources.append(other.source)
        socket.send(json.dumps({"next": 10}))
        changed = json.loads(socket.recv(timeout=30))["changed"]
        assert changed == httpx.get(server.url + LAYOUT_PATH).json()["generation"] > before
        assert ask(socket, columns=NAMES, since=0, generation=changed)[1] == 3


def test_without_a_host_the_page_is_told_to_wait(feed: Feed) -> None:
    with serve(lambda: None) as server, joined(server) as socket:
        assert httpx.get(server.url + LAYOUT_PATH).status_code == 503
        socket.send(json.dumps({"columns": NAMES}))
        assert json.loads(socket.recv(timeout=30)) == {"changed": None}


def test_who_is_not_permitted_reads_nothing(feed: Feed) -> None:
    with serve(lambda: feed.source, authorised=lambda request: "let" in request.headers) as server:
        assert httpx.get(server.url + LAYOUT_PATH).status_code == 403
        assert httpx.get(server.url + LAYOUT_PATH, headers={"let": "me"}).status_code == 200
        with pytest.raises(InvalidStatus):
            joined(server)
