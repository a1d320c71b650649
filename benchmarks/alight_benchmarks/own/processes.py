"""Measuring in processes of their own: what must be imported, compiled or filled afresh."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from typing import Any

PREAMBLE = """
import json, pathlib, resource, sys, time

def peak_memory():
    # in bytes; on Linux getrusage counts the process that started this one, too
    status = pathlib.Path("/proc/self/status")
    if status.exists():
        lines = (line.split() for line in status.read_text().splitlines())
        return next(1024 * int(words[1]) for words in lines if words[0] == "VmHWM:")
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss

def tell(**found):
    print(json.dumps(found))
"""


def told_by(code: str, **environment: str) -> dict[str, Any]:
    """Run code that calls ``tell`` last, and return what it told."""
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", PREAMBLE + code],
        env={**os.environ, **environment},
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    return json.loads(done.stdout.splitlines()[-1])


def seconds_of(code: str, times: int) -> list[float]:
    """Time of a whole Python process that runs some code, several times [s]."""
    found = []
    for _ in range(times):
        began = time.perf_counter()
        subprocess.run([sys.executable, "-c", code], stdout=subprocess.DEVNULL, check=True)
        found.append(time.perf_counter() - began)
    return found
