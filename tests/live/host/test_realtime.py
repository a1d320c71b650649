"""What the host says of the system's permissions is what the system permits."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from typing import Any

import pytest

from tests.cli.command import environment

LINUX = pytest.mark.skipif(sys.platform != "linux", reason="others are asked for less")
FACTS = """
import gc, json, os, resource, sys
from alight.live.host.realtime import prepare, spin
if len(sys.argv) > 1:
    resource.setrlimit(resource.RLIMIT_RTPRIO, (0, 0))
    resource.setrlimit(resource.RLIMIT_MEMLOCK, (0, 0))
    if os.geteuid() == 0:  # root is permitted everything
        os.setuid(65534)
before = sorted(os.sched_getaffinity(0))
lines = {}
for line in prepare(None):
    name, _, what = line.partition(": ")
    lines[name] = what
status = open("/proc/self/status").read()
locked = int(status.split("VmLck:")[1].split()[0])
print(json.dumps({
    "lines": lines, "garbage": gc.isenabled(), "locked": locked, "before": before,
    "cores": sorted(os.sched_getaffinity(0)), "scheduler": os.sched_getscheduler(0), "spin": spin(),
}))
"""


def facts(*args: str) -> dict[str, Any]:
    command = [sys.executable, "-c", FACTS, *args]
    done = subprocess.run(command, env=environment(), capture_output=True, text=True, check=True)
    found: dict[str, Any] = json.loads(done.stdout)
    return found


@LINUX
@pytest.mark.parametrize("refused", [[], ["refused"]])
def test_each_line_tells_what_is_so(refused):
    found = facts(*refused)
    lines = found["lines"]
    assert set(lines) == {"garbage collection", "memory", "processor core", "priority", "timers"}
    assert lines["garbage collection"] == "off" and not found["garbage"]
    assert lines["memory"].startswith("locked") == (found["locked"] > 0)
    assert lines["priority"].startswith("real time,") == (found["scheduler"] == os.SCHED_FIFO)
    own = len(found["before"]) > 1
    assert found["cores"] == (found["before"][-1:] if own else found["before"])
    assert lines["processor core"].startswith(str(found["cores"][0]) if own else "shared")
    if refused:
        assert lines["memory"].startswith("not locked: ") and "ulimit -l" in lines["memory"]
        assert "was refused: " in lines["priority"] and "ulimit -r" in lines["priority"]
        assert found["spin"] == 0


@LINUX
def test_a_core_that_is_not_there_is_said_to_be_refused():
    script = "from alight.live.host.realtime import prepare; print(prepare(4095)[2])"
    command = [sys.executable, "-c", script]
    done = subprocess.run(command, env=environment(), capture_output=True, text=True, check=True)
    assert "core 4095 was refused" in done.stdout
