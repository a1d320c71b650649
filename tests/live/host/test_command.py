"""``alight live`` refuses, before anything has begun, what cannot go well."""

from __future__ import annotations

import importlib.util
import os
import socket

import pytest

from alight.live import supervisor
from alight.live.session import Settings
from alight.live.supervisor import address_of, free_port
from tests.cli.command import invoke

TOKEN = "0123456789abcdef"


@pytest.fixture(autouse=True)
def nothing_begins(tmp_path, monkeypatch):
    """A refusal leaves no folder."""
    monkeypatch.chdir(tmp_path)

    def refused(*_: object) -> None:
        raise AssertionError("a bench would have begun")

    monkeypatch.setattr(supervisor, "supervise", refused)
    yield
    assert os.listdir(tmp_path) == []


@pytest.mark.parametrize(
    ("args", "says"),
    [
        (("--host", "0.0.0.0"), "--token of 16 characters or more"),
        (("--host", "::"), "--token of 16 characters or more"),
        (("--host", "bench.example"), "could steer the bench"),
        (("--host", "0.0.0.0", "--token", "short"), "--token: 5 characters; 16 or more"),
        (("--token", ""), "--token: 0 characters"),
        (("--drives", "nowhere.toml"), "nowhere.toml: there is no such file"),
        (("--set", "plant.body.m=-1"), "plant.body.m"),
        (("--set", "target.x_md=9"), "reach"),
        (("--host", "203.0.113.1", "--token", TOKEN), "cannot listen on 203.0.113.1"),
        (("--host", "not an address", "--token", TOKEN), "cannot listen on not an address"),
    ],
)
def test_it_is_refused_with_2_and_the_reason(args, says):
    result = invoke("live", "experiment-1", *args)
    assert result.exit_code == 2 and result.stdout == ""
    assert result.stderr.startswith(("error: ", "Usage")) and says in result.stderr


def test_a_port_that_is_taken_is_refused():
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        result = invoke("live", "experiment-1", "--port", str(port))
        assert result.exit_code == 2
        assert f"port {port}: Address already in use; take another --port" in result.stderr


def test_without_nicegui_it_names_the_extra(monkeypatch):
    find = importlib.util.find_spec
    monkeypatch.setattr(importlib.util, "find_spec", lambda n: None if n == "nicegui" else find(n))
    result = invoke("live", "experiment-1")
    assert result.exit_code == 2 and "pip install 'alight[live]'" in result.stderr


def test_port_0_gives_one_that_is_free():
    port = free_port("127.0.0.1", 0)
    with socket.create_server(("127.0.0.1", port)):
        assert port > 0


@pytest.mark.parametrize(
    ("host", "token", "address"),
    [
        ("127.0.0.1", None, "http://127.0.0.1:80/"),
        ("::1", None, "http://[::1]:80/"),
        ("192.0.2.7", TOKEN, f"http://192.0.2.7:80/?token={TOKEN}"),
        ("0.0.0.0", TOKEN, f"http://{socket.gethostname()}:80/?token={TOKEN}"),
    ],
)
def test_the_address_is_one_for_a_browser(host, token, address):
    assert address_of(Settings({}, "", host=host, token=token, port=80)) == address
