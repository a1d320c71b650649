"""What no page of ours does: garbage, connections by the thousand, readers that never read."""

from __future__ import annotations

import contextlib
import json
import os
import socket
import struct
from collections.abc import Iterator

CONNECTIONS, SLOW, ASKED = 1000, 8, 200


GARBAGE = (
    b"\0" * 64,
    b"GET / HTTP/1.1\r\nHost: " + b"a" * 100_000,
    b"GET / HTTP/9.9\r\n\r\n",
    b"POST /live/telemetry HTTP/1.1\r\nHost: localhost\r\nContent-Length: 99999999999\r\n\r\n",
    b"GET /%ff%fe HTTP/1.1\r\nHost: localhost\r\n\r\n",
    b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03",
    os.urandom(4096),
)


def attach(port: int) -> socket.socket:
    """A connection to the page."""
    return socket.create_connection(("127.0.0.1", port), timeout=20)


@contextlib.contextmanager
def raw_websocket(port: int) -> Iterator[socket.socket]:
    """A stream of telemetry whose window is small, as that of one who never reads."""
    made_socket = socket.socket()
    made_socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    with made_socket as plain:
        plain.settimeout(20)
        plain.connect(("127.0.0.1", port))
        plain.sendall(
            b"GET /live/telemetry HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\n"
            b"Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
            b"Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n"
        )
        assert b" 101 " in plain.recv(200)
        yield plain


def frame(text: str) -> bytes:
    """A text frame of RFC 6455 as a client sends it, masked with zeros."""
    content = text.encode()
    length = len(content)
    size = bytes([0x80 | length]) if length < 126 else b"\xfe" + struct.pack(">H", length)
    return b"\x81" + size + bytes(4) + content


def keep_off(core: int | None) -> None:
    """Leave a core to the host."""
    if core is not None and (others := os.sched_getaffinity(0) - {core}):
        os.sched_setaffinity(0, others)


def besiege(port: int, columns: list[str], core: int | None) -> None:
    """Do all of it, again and again; from another core than the host's, as from elsewhere."""
    keep_off(core)
    while True:
        held: list[socket.socket] = []
        with contextlib.ExitStack() as stack, contextlib.suppress(OSError):
            for _ in range(SLOW):
                slow = stack.enter_context(raw_websocket(port))
                slow.sendall(frame(json.dumps({"columns": columns, "since": 0})))
                for _ in range(ASKED):
                    slow.sendall(frame(json.dumps({"next": 0})))
        for number in range(CONNECTIONS):
            with contextlib.suppress(OSError):
                held.append(attach(port))
                if number % 3 == 0:
                    held[-1].sendall(GARBAGE[number % len(GARBAGE)])
        for connection in held:
            connection.close()
