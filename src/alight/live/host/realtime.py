"""What a hard-timed loop asks of the system, and what the system permitted."""

from __future__ import annotations

import ctypes
import gc
import os
import resource
import sys
from collections.abc import Callable

PRIORITY = 80
"""Of the range 1 to 99 of SCHED_FIFO: above everything but the kernel's own most urgent threads."""
PLENTY = 4
"""Processor cores of a machine on which one of them may be kept awake for the host."""
SPIN = 100e-6
"""How long before a deadline the host then wakes up [s], to be on time to a microsecond: measured,
a sleeper on a core of its own wakes up 50 to 100 microseconds late."""
_MCL_CURRENT, _MCL_FUTURE = 1, 2
_PR_SET_TIMERSLACK = 29


def prepare(core: int | None) -> list[str]:
    """Ask for everything; say in a line each what was permitted, and what was not and why."""
    steps: list[Callable[[], str]] = [
        _no_garbage,
        _memory,
        lambda: _own_core(core),
        _priority,
        _fine_timers,
    ]
    return [step() for step in steps]


def spin() -> float:
    """Time [s] before a deadline in which a prepared host may look at the clock without a pause.

    A core that never sleeps is too much to ask of a small machine, and a spinning process without
    a real-time priority only uses up its share.
    """
    if not hasattr(os, "sched_getscheduler"):
        return 0.0
    own = len(os.sched_getaffinity(0)) == 1 and os.sched_getscheduler(0) == os.SCHED_FIFO
    return SPIN if own and (os.cpu_count() or 1) >= PLENTY else 0.0


def _no_garbage() -> str:
    gc.collect()
    gc.freeze()
    gc.disable()
    return "garbage collection: off"


def _memory() -> str:
    name = "memory"
    if sys.platform != "linux":
        return f"{name}: not locked; {sys.platform} is not asked for it"
    limit, _ = resource.getrlimit(resource.RLIMIT_MEMLOCK)
    # Under a finite limit memory that is locked as it is taken would be refused some day.
    may_grow = limit == resource.RLIM_INFINITY or os.geteuid() == 0
    error = _called("mlockall", _MCL_CURRENT | (_MCL_FUTURE if may_grow else 0))
    if not error:
        return f"{name}: locked" + ("" if may_grow else ", what is taken later is not")
    return f"{name}: not locked: {error}; ulimit -l unlimited would permit it"


def host_core(asked: int | None) -> int | None:
    """The processor core that the host gets: the one asked for, or the last; None if all share one.

    Where there is one core only, or the system has no say in it, there is none.
    """
    if not hasattr(os, "sched_getaffinity"):
        return None
    cores = os.sched_getaffinity(0)
    return asked if asked is not None else (max(cores) if len(cores) > 1 else None)


def _own_core(asked: int | None) -> str:
    name = "processor core"
    if not hasattr(os, "sched_setaffinity"):
        return f"{name}: any; {sys.platform} cannot pin a process to one"
    core = host_core(asked)
    if core is None:
        return f"{name}: shared; there is one only"
    try:
        os.sched_setaffinity(0, {core})
    except OSError as error:
        return f"{name}: any; core {core} was refused: {error.strerror}"
    return f"{name}: {core}, which the bench's other processes leave alone"


def _priority() -> str:
    name = "priority"
    if not hasattr(os, "sched_setscheduler"):
        return f"{name}: that of every process; {sys.platform} has no SCHED_FIFO to ask for"
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
    except OSError as error:
        remedy = "ulimit -r 80, or CAP_SYS_NICE, would permit it"
        return f"{name}: that of every process; real time was refused: {error.strerror}; {remedy}"
    return f"{name}: real time, SCHED_FIFO {PRIORITY}"


def _fine_timers() -> str:
    name = "timers"
    if sys.platform != "linux":
        return f"{name}: as {sys.platform} sets them"
    # Without a real-time priority Linux wakes a sleeper up to 50 microseconds late on purpose.
    error = _called("prctl", _PR_SET_TIMERSLACK, 1, 0, 0, 0)
    return f"{name}: slack of 50 us remains: {error}" if error else f"{name}: without slack"


def _called(name: str, *args: int) -> str:
    """Call a function of the C library; what went wrong, empty if nothing did."""
    function = getattr(ctypes.CDLL(None, use_errno=True), name)
    if function(*(ctypes.c_ulong(arg) if i else arg for i, arg in enumerate(args))) == 0:
        return ""
    return os.strerror(ctypes.get_errno())
