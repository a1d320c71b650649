"""Who may come in: every route, websocket and socket.io included, passes here first."""

from __future__ import annotations

import hmac
import ipaddress
from collections.abc import Callable, Iterable
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qsl, quote, unquote, urlsplit

from starlette.responses import PlainTextResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

COOKIE = "alight"
LOOPBACK_NAMES = ("localhost", "localhost.localdomain", "ip6-localhost")
POLICY = 1008
"""Close code of RFC 6455 for what is not permitted."""

PAGES = ("/", "/favicon.ico", "/live/layout.json", "/live/telemetry")
FOLDERS = ("/live/static/", "/_nicegui/", "/_nicegui_ws/")
"""Everything that there is. Asking for anything else makes NiceGUI build a page that says so."""

SAFE = {
    "Content-Security-Policy": (
        "default-src 'self'; script-src 'self' 'unsafe-inline' 'unsafe-eval' blob:; "
        "style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; font-src 'self' data:; "
        "connect-src 'self'; object-src 'none'; base-uri 'self'; form-action 'self'; "
        "frame-ancestors 'none'"
    ),
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Cross-Origin-Resource-Policy": "same-origin",
}
"""What every answer tells the browser: nothing from elsewhere, and in nobody's frame."""


def is_loopback(host: str) -> bool:
    """Whether an address or name means this machine alone."""
    if host.lower().rstrip(".") in LOOPBACK_NAMES:
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


class Guard:
    """Lets requests through that carry the right host, origin and token, and refuses all others.

    Without a token the page answers to this machine's own names alone, so that no name of a
    foreign site can be made to point here; with one, to whoever knows it. It is given once, as
    ``?token=``, and kept by the browser in a cookie that no script can read and no other site can
    send.

    Parameters
    ----------
    app : ASGI application
        What is guarded.
    token : str or None
        The token; None where only this machine can connect.
    crowded : callable, optional
        Whether there are too many pages to open another one.
    """

    def __init__(
        self,
        app: ASGIApp,
        token: str | None = None,
        crowded: Callable[[], bool] = lambda: False,
    ) -> None:
        self.app = app  # NiceGUI looks for itself along this name
        self._token, self._crowded = token, crowded

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve a request or socket."""
        if scope["type"] == "lifespan":
            await self.app(scope, receive, send)
            return
        refusal = self._refusal(scope)
        if scope["type"] == "websocket":
            if refusal is None:
                await self.app(scope, receive, send)
            else:
                await _refuse_socket(receive, send)
            return
        if scope["type"] == "http":
            if refusal is None:
                await self.app(scope, receive, _marked(send))
            else:
                await refusal(scope, receive, _marked(send))

    def _refusal(self, scope: Scope) -> Response | None:
        """What a request gets that is not let through; None for one that is."""
        headers = _headers(scope)
        host = headers.get("host", "")
        if self._token is None and not is_loopback(_name(host)):
            return PlainTextResponse("this page answers to this machine alone", 403)
        origin = headers.get("origin")
        if origin is not None and urlsplit(origin).netloc.lower() != host.lower():
            return PlainTextResponse("another site may not use this page", 403)
        if scope["type"] == "http" and scope["method"] not in ("GET", "HEAD"):
            return PlainTextResponse("only GET is served", 405)
        if self._token is not None and (refusal := self._unknown(scope, headers)) is not None:
            return refusal
        if scope["path"] not in PAGES and not scope["path"].startswith(FOLDERS):
            return PlainTextResponse("there is no such page", 404)
        if scope["type"] == "http" and scope["path"] == "/" and self._crowded():
            text = "too many pages are open; close one, and try again in a minute"
            return PlainTextResponse(text, 503, {"Retry-After": "30"})
        return None

    def _unknown(self, scope: Scope, headers: dict[str, str]) -> Response | None:
        """Refusal of a request without the token; one that brings it is given the cookie."""
        assert self._token is not None
        if any(_equal(value, self._token) for value in _cookies(headers.get("cookie", ""))):
            return None
        query = parse_qsl(scope["query_string"].decode("latin-1"), keep_blank_values=True)
        given = [value for key, value in query if key == "token"]
        if scope["type"] == "http" and any(_equal(value, self._token) for value in given):
            answer = RedirectResponse(quote(scope["path"] or "/"), 303)
            answer.set_cookie(
                COOKIE, quote(self._token, safe=""), httponly=True, samesite="strict", path="/"
            )
            return answer
        if given:
            return PlainTextResponse("this is not the token", 403)
        return PlainTextResponse("a token is needed: open the address that alight live shows", 401)


def _headers(scope: Scope) -> dict[str, str]:
    return {key.decode("latin-1"): value.decode("latin-1") for key, value in scope["headers"]}


def _name(host: str) -> str:
    """The name in a ``Host`` header, without port and brackets."""
    try:
        return urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return ""


def _cookies(header: str) -> Iterable[str]:
    try:
        found = SimpleCookie(header)
    except CookieError:
        return []
    return [unquote(found[COOKIE].value)] if COOKIE in found else []


def _equal(one: str, other: str) -> bool:
    """Whether two texts are equal, in a time that does not tell where they differ."""
    return hmac.compare_digest(one.encode(), other.encode())


def _marked(send: Send) -> Send:
    """Add `SAFE` to the head of an answer."""
    extra = [(key.lower().encode(), value.encode()) for key, value in SAFE.items()]

    async def sending(message: Message) -> None:
        if message["type"] == "http.response.start":
            message = {**message, "headers": [*message.get("headers", ()), *extra]}
        await send(message)

    return sending


async def _refuse_socket(receive: Receive, send: Send) -> None:
    """Refuse a websocket before it is one: the server answers with 403."""
    message: dict[str, Any] = await receive()  # type: ignore[assignment]
    if message["type"] == "websocket.connect":
        await send({"type": "websocket.close", "code": POLICY})
