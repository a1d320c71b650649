"""``python -m alight.live.devices.cia402.simulated CONFIG SCENARIO [PATH=VALUE ...]``.

The simulated bench as a process of its own, for the same configuration and scenario as the host.
Prints a line of JSON when it is ready and at each change of a drive, and takes ``unplug NODE``,
``plug NODE`` and ``fault NODE CODE`` from its standard input. Ends on SIGTERM or SIGINT.
"""

from __future__ import annotations

import json
import os
import signal
import sys
from typing import Any

from alight.errors import AlightError
from alight.live.devices.cia402.config import load_drives
from alight.live.devices.cia402.simulated.bench import SimulatedBench
from alight.live.devices.cia402.simulated.drive import SimulatedDrive
from alight.scenarios import load_scenario

REFUSED = 2
WAIT = 0.002
"""Longest time [s] without a look at the watchdogs."""


def main(arguments: list[str]) -> int:
    """Run the bench until it is told to end.

    Returns
    -------
    int
        Exit code: 0, or 2 if configuration or scenario are refused.
    """
    if len(arguments) < 2:
        print(__doc__, file=sys.stderr)
        return REFUSED
    try:
        settings, scenario = load_drives(arguments[0]), load_scenario(arguments[1], arguments[2:])
        bench = SimulatedBench(settings, scenario, tell=_say)
    except AlightError as error:
        print(f"error: {error}", file=sys.stderr)
        return REFUSED
    ended = False

    def end(*_: object) -> None:
        nonlocal ended
        ended = True

    signal.signal(signal.SIGTERM, end)
    signal.signal(signal.SIGINT, end)
    _say({"ready": True, "pid": os.getpid()})
    orders = _orders()
    while not ended:
        bench.serve(WAIT)
        for order in orders():
            _obey(bench, order)
    bench.close()
    return 0


def _say(change: dict[str, Any]) -> None:
    print(json.dumps(change), flush=True)


def _orders() -> Any:
    """What has come on standard input, line by line, without waiting."""
    try:
        os.set_blocking(sys.stdin.fileno(), False)
    except (OSError, ValueError):
        return list
    rest = b""

    def read() -> list[list[str]]:
        nonlocal rest
        try:
            rest += os.read(sys.stdin.fileno(), 4096)
        except (BlockingIOError, OSError):
            return []
        *lines, rest = rest.split(b"\n")
        return [line.decode(errors="replace").split() for line in lines]

    return read


def _obey(bench: SimulatedBench, order: list[str]) -> None:
    match order:
        case ["unplug", number]:
            for node in bench.nodes:
                if node.number == int(number):
                    node.unplug()
        case ["plug", number]:
            for node in bench.nodes:
                if node.number == int(number):
                    node.plug()
        case ["fault", number, code]:
            for node in bench.nodes:
                if node.number == int(number) and isinstance(node, SimulatedDrive):
                    node.fault(int(code, 0))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
