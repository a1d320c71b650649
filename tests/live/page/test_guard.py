"""Who may come in, with real sockets against the real server; and who cannot harm it."""

import contextlib
import json
import socket
import threading

import httpx
import psutil
import pytest
from hypothesis import given
from hypothesis import strategies as st
from websockets.exceptions import ConnectionClosed, InvalidHandshake, InvalidMessage
from websockets.sync.client import connect

from alight.live.page.guard import is_loopback
from alight.live.page.limited import MOST
from tests.live.bench import bench, gather, lives, wait_for
from tests.live.hostile import GARBAGE, attach, frame, raw_websocket

TOKEN = "correct horse battery staple é"
PATHS = (
    "/",
    "/live/layout.json",
    "/live/static/bench.js",
    "/live/static/panels.css",
    "/favicon.ico",
    "/no/such/page",
    "/_nicegui_ws/socket.io/?EIO=4&transport=polling",
)
SOCKETS = ("/live/telemetry", "/_nicegui_ws/socket.io/?EIO=4&transport=websocket")


def answers(url):
    """Status with which it answers; None if it does not."""
    with contextlib.suppress(httpx.TransportError):
        return httpx.get(f"{url}live/layout.json", trust_env=False).status_code
    return None


@pytest.fixture(scope="module")
def opened(tmp_path_factory):
    with bench(tmp_path_factory.mktemp("bench"), parts=("host", "page")) as made:
        made.link()
        wait_for(lambda: answers(made.url) == 200)
        yield made


@pytest.fixture(scope="module")
def locked(tmp_path_factory):
    with bench(tmp_path_factory.mktemp("bench"), parts=("page",), token=TOKEN) as made:
        wait_for(lambda: answers(made.url) == 401)
        yield made


def get(made, path, **headers):
    return httpx.get(made.url.rstrip("/") + path, headers=headers, trust_env=False)


def handshake(made, path, **headers):
    """Status with which a websocket is answered: 101 if it is let in."""
    url = made.url.replace("http", "ws", 1).rstrip("/") + path
    try:
        with connect(url, additional_headers=headers, proxy=None):
            return 101
    except InvalidHandshake as refusal:
        return refusal.response.status_code


@pytest.mark.parametrize("path", PATHS)
def test_a_name_of_another_site_does_not_lead_here(opened, path):
    assert get(opened, path, Host="evil.example").status_code == 403
    assert get(opened, path, Host="127.0.0.1.evil.example:8080").status_code == 403
    assert get(opened, path, Host="").status_code in (400, 403)
    assert get(opened, path, Host="localhost:9999").status_code != 403


@pytest.mark.parametrize("path", SOCKETS)
def test_a_socket_of_another_site_is_refused(opened, path):
    port = opened.settings.port
    assert handshake(opened, path) == 101
    assert handshake(opened, path, Origin=f"http://127.0.0.1:{port}") == 101
    for origin in (
        "http://evil.example",
        f"http://evil.example:{port}",
        "null",
        "http://127.0.0.1",
    ):
        assert handshake(opened, path, Origin=origin) == 403


def test_nothing_can_be_sent_but_questions(opened):
    for method in ("POST", "PUT", "DELETE", "PATCH", "OPTIONS", "TRACE"):
        answer = httpx.request(method, opened.url, trust_env=False)
        assert answer.status_code == 405


def test_the_browser_is_told_to_fetch_nothing_from_elsewhere(opened):
    head = get(opened, "/").headers
    assert "default-src 'self'" in head["content-security-policy"]
    assert "frame-ancestors 'none'" in head["content-security-policy"]
    assert "http:" not in head["content-security-policy"]


@pytest.mark.parametrize("path", PATHS)
def test_without_the_token_there_is_nothing(locked, path):
    assert get(locked, path).status_code == 401
    assert get(locked, path, Cookie="alight=guessed").status_code == 401
    joined = f"{path}{'&' if '?' in path else '?'}token="
    assert get(locked, joined + "guessed").status_code == 403
    assert get(locked, joined).status_code == 403


@pytest.mark.parametrize("path", SOCKETS)
def test_without_the_token_no_socket_opens(locked, path):
    assert handshake(locked, path) == 403
    assert handshake(locked, path, Cookie="alight=guessed") == 403


def test_the_token_is_given_once_and_kept_in_a_cookie(locked):
    with httpx.Client(base_url=locked.url, trust_env=False) as client:
        first = client.get("/", params={"token": TOKEN})
        assert first.status_code == 303
        assert first.headers["location"] == "/"
        kept = first.headers["set-cookie"].lower()
        assert "httponly" in kept
        assert "samesite=strict" in kept
        assert client.get("/").status_code == 200
        assert client.get("/live/static/bench.js").status_code == 200
        cookie = first.headers["set-cookie"].partition(";")[0]
    for path in SOCKETS:
        assert handshake(locked, path, Cookie=cookie) == 101
        assert handshake(locked, path, Cookie=cookie, Origin="http://evil.example") == 403


@given(st.binary(min_size=4, max_size=4))
def test_loopback_is_127_whatever_the_rest(packed):
    assert is_loopback(socket.inet_ntoa(packed)) == (packed[0] == 127)


@pytest.mark.parametrize("host", ["", "127.0.0.1.nip.example", "0.0.0.0", "::", "localhost.evil"])
def test_what_only_looks_like_loopback(host):
    assert not is_loopback(host)


def test_garbage_and_a_thousand_connections_leave_page_and_loop_alive(opened):
    link, pid = opened.link(), opened.pid("page")
    before = link.ring.head
    held = []
    try:
        for number in range(1000):
            with contextlib.suppress(OSError):
                held.append(attach(opened.settings.port))
                if number % 3 == 0:
                    held[-1].sendall(GARBAGE[number % len(GARBAGE)])
        wait_for(lambda: answers(opened.url) == 200)
        # However many knock, only so many are let in.
        assert len(psutil.Process(pid).net_connections("tcp")) <= MOST + 2
        gather(link, before, 100)
    finally:
        for connection in held:
            connection.close()
    wait_for(lambda: answers(opened.url) == 200)
    assert lives(pid)


def test_words_that_nobody_of_ours_says_end_their_socket_alone(opened):
    url = opened.url.replace("http", "ws", 1)
    with connect(f"{url}live/telemetry", proxy=None) as good:
        for path, words in {
            "live/telemetry": ["", "[", "[]", '{"next": -1}', '{"columns": 3}', b"\xff" * 99],
            SOCKETS[1].lstrip("/"): ["", "9", "42", "40{", '42["event"]', '42["event",7]', b"\0"],
        }.items():
            for word in words:
                with (
                    contextlib.suppress(ConnectionClosed, InvalidMessage, OSError),
                    connect(url + path, proxy=None) as bad,
                ):
                    bad.send(word)
        names = list(opened.link().layout.columns)[:2]
        good.send(json.dumps({"columns": names, "since": 0}))
        assert good.recv(timeout=20)
    assert answers(opened.url) == 200


def test_one_who_asks_and_never_reads_holds_nobody_up(opened):
    """Its window is closed: what it asked for cannot be sent, and nothing piles up."""
    memory = psutil.Process(opened.pid("page")).memory_info
    before = memory().rss
    url = f"{opened.url.replace('http', 'ws', 1)}live/telemetry"
    columns = list(opened.link().layout.columns)
    with contextlib.ExitStack() as stack:
        for _ in range(8):
            slow = stack.enter_context(raw_websocket(opened.settings.port))
            slow.sendall(frame(json.dumps({"columns": columns, "since": 0})))
            for _ in range(200):
                slow.sendall(frame(json.dumps({"next": 0})))
        with connect(url, proxy=None) as good:
            good.send(json.dumps({"columns": columns[:1], "since": 0}))
            for _ in range(20):
                good.send(json.dumps({"next": opened.link().ring.head - 10}))
                assert good.recv(timeout=20)
        assert memory().rss - before < 200e6
    assert answers(opened.url) == 200


def test_an_open_address_without_a_token_is_not_served(tmp_path):
    with bench(tmp_path, host="0.0.0.0") as made:
        assert made.start("page").wait(60) == 2


def test_the_page_leaves_the_host_its_core(opened):
    page, host = (psutil.Process(opened.pid(part)) for part in ("page", "host"))
    assert page.nice() > 0
    if len(host.cpu_affinity()) == 1 and psutil.cpu_count() > 1:
        assert not set(page.cpu_affinity()) & set(host.cpu_affinity())


def test_too_many_pages_are_refused_with_a_reason(opened):
    seen = []

    def ask():
        seen.append(httpx.get(opened.url, trust_env=False, timeout=30).status_code)

    threads = [threading.Thread(target=ask) for _ in range(60)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert set(seen) == {200, 503}
