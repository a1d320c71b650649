"""Connections: few enough, and none that says nothing."""

from __future__ import annotations

import asyncio
from typing import Any, ClassVar

from uvicorn.protocols.http.h11_impl import H11Protocol

MOST = 200
"""Connections that are open at once."""
SPEECHLESS = 10.0
"""Time [s] in which a connection must have asked for something."""


class LimitedProtocol(H11Protocol):
    """HTTP of uvicorn for a bounded number of connections.

    Beyond, the one that has waited longest without ever asking for anything makes room; where all
    have asked, the new one is refused.
    """

    _silent: ClassVar[dict[LimitedProtocol, None]] = {}
    """Those that have not asked yet, in the order in which they came."""

    def connection_made(self, transport: Any) -> None:
        """Take a connection, or refuse it."""
        super().connection_made(transport)
        self._silent[self] = None
        loop = asyncio.get_running_loop()
        self._patience = loop.call_later(SPEECHLESS, self._drop_silent)
        if len(self.connections) > MOST:
            next(iter(self._silent))._drop_silent()

    def data_received(self, data: bytes) -> None:
        """Take what a connection says."""
        super().data_received(data)
        if self.scope is not None:
            self._heard()

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget a connection."""
        self._heard()
        super().connection_lost(exc)

    def _heard(self) -> None:
        self._silent.pop(self, None)
        self._patience.cancel()

    def _drop_silent(self) -> None:
        self._heard()
        self.connections.discard(self)
        self.transport.abort()
