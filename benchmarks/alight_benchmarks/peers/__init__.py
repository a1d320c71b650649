"""Each module here states its ``PEERS``; none imports its tool before it is prepared to run."""

from __future__ import annotations

import pkgutil
from importlib import import_module

from alight_benchmarks.peer import Peer

ALL: tuple[Peer, ...] = tuple(
    peer
    for module in pkgutil.iter_modules(__path__)
    for peer in import_module(f"{__name__}.{module.name}").PEERS
)
"""Every peer there is."""
