"""One core for everything, and what is to be said of the machine."""

from __future__ import annotations

import contextlib
import datetime
import os
import platform
import subprocess
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path
from typing import Any

ONE_THREAD = {
    **dict.fromkeys(
        (
            "OMP_NUM_THREADS",
            "OPENBLAS_NUM_THREADS",
            "MKL_NUM_THREADS",
            "VECLIB_MAXIMUM_THREADS",
            "NUMBA_NUM_THREADS",
        ),
        "1",
    ),
    "XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false",
    "JAX_PLATFORMS": "cpu",
}
"""Read by libraries when they are imported: call `one_core` before."""
CAN_PIN = hasattr(os, "sched_setaffinity")


@contextlib.contextmanager
def one_core() -> Iterator[list[int]]:
    """Keep this process, and the libraries that it will import, to one core.

    Yields the processors that it may use otherwise.
    """
    allowed = processors()
    before = {name: os.environ.get(name) for name in ONE_THREAD}
    os.environ.update(ONE_THREAD)
    try:
        with on_processors(allowed[:1]):
            yield allowed
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def processors() -> list[int]:
    """Processors that this thread may use: one of each core, the last core first, then the rest."""
    if not CAN_PIN:
        return list(range(os.cpu_count() or 1))
    allowed = sorted(os.sched_getaffinity(0), reverse=True)
    of_core = {_siblings(number): number for number in allowed}
    first = [number for number in allowed if number in of_core.values()]
    return [*first, *(number for number in allowed if number not in first)]


def cores(numbers: list[int]) -> int:
    """How many cores some processors belong to."""
    return len({_siblings(number) for number in numbers})


def _siblings(number: int) -> str:
    path = Path(f"/sys/devices/system/cpu/cpu{number}/topology/thread_siblings_list")
    try:
        return path.read_text("ascii").strip()
    except OSError:
        return str(number)


@contextlib.contextmanager
def on_processors(numbers: list[int]) -> Iterator[None]:
    """Keep this thread, and those that it starts, to some processors, where the system permits."""
    if not CAN_PIN:
        yield
        return
    before = os.sched_getaffinity(0)
    with contextlib.suppress(OSError):
        os.sched_setaffinity(0, numbers)
    try:
        yield
    finally:
        with contextlib.suppress(OSError):
            os.sched_setaffinity(0, before)


def description() -> dict[str, Any]:
    """Processor, system, compiler and versions, as plain data."""
    from alight.kernels.compilers import find_compiler
    from alight.kernels.lanes.kernel import FLAGS as LANE_FLAGS
    from alight_benchmarks.generated import FLAGS, compiler
    from alight_benchmarks.own.peak import lanes

    return {
        "date": datetime.datetime.now().astimezone().date().isoformat(),
        "processor": _processor(),
        "processors": os.cpu_count(),
        "load": round(os.getloadavg()[0], 1) if hasattr(os, "getloadavg") else None,
        "pinned": CAN_PIN,
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "plain_compiler": _version(compiler()),
        "compiler": find_compiler().version.splitlines()[0],
        "flags": " ".join(flag for flag in FLAGS if flag not in ("-fPIC", "-shared", "-w")),
        "lane_flags": " ".join(flag for flag in LANE_FLAGS if flag != "-fvisibility=hidden"),
        "lanes": lanes(),
    }


def versions(packages: list[str]) -> dict[str, str | None]:
    """Version of each distribution, None where it is not installed."""
    found: dict[str, str | None] = {}
    for package in packages:
        try:
            found[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            found[package] = None
    return found


def _version(program: str) -> str:
    command = [program, "--version"]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, errors="replace", check=True)
    return done.stdout.splitlines()[0]


def _processor() -> str:
    """Name of the processor, and its model where the name says little."""
    entries: dict[str, str] = {}
    with contextlib.suppress(OSError):
        for line in Path("/proc/cpuinfo").read_text("utf-8", "replace").splitlines():
            name, _, value = line.partition(":")
            entries.setdefault(name.strip(), value.strip())
    if "model name" in entries:
        numbers = f"family {entries.get('cpu family')}, model {entries.get('model')}"
        return f"{entries['model name']} ({numbers})"
    return platform.processor() or platform.machine()
