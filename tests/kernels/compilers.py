"""Compilers that do not work, each in its own way: real programs, called as compilers are."""

from __future__ import annotations

import ctypes
import os
import time
from collections.abc import Callable
from pathlib import Path

from alight.kernels.toolchain import cache_folder

SOURCE = (
    "#include <math.h>\ndouble seven(void) { return 7; }\ndouble f(double x) { return tanh(x); }"
)
FLAGS = ("-O1",)


def other(i: int) -> str:
    """The same source with another number."""
    return SOURCE.replace("7", str(i))


def seven(library: ctypes.CDLL) -> float:
    """The number in a library of this source."""
    library.seven.restype = ctypes.c_double
    return library.seven()


ANSWERS = 'case "$1" in --version) echo "compiler 1.0"; exit 0;; esac'
OUTPUT = 'while [ "$1" != "-o" ]; do shift; done'


def script(path: Path, *lines: str) -> str:
    """A program made of lines of shell, and its path."""
    path.write_text("\n".join(["#!/bin/sh", *lines, ""]))
    path.chmod(0o755)
    return str(path)


def broken_compilers(folder: Path) -> dict[str, tuple[str, str]]:
    """Value of ``CC`` and what the message says of it, by what is wrong."""
    text = folder / "cc-text"
    text.write_bytes(b"\x00\x01\x02")
    text.chmod(0o755)
    fails = script(folder / "cc-fails", ANSWERS, "echo 'no space'; echo ' for poetry' >&2; exit 1")
    return {
        "missing": (str(folder / "cc-nowhere"), "is no program on the path"),
        "unreadable": ("cc '", "cannot be read: No closing quotation"),
        "not a program": (str(text), "cc-text does not run"),
        "mute": (script(folder / "cc-mute", "exit 1"), "cc-mute does not run"),
        "failing": (fails, "cc-fails failed: no space for poetry"),
        "idle": (script(folder / "cc-idle", ANSWERS), "cannot be loaded: .*code.so"),
        "babbling": (
            script(folder / "cc-babbles", ANSWERS, OUTPUT, 'echo "no library at all" > "$2"'),
            "cannot be loaded: .*code.so",
        ),
    }


def waiting_compiler(folder: Path) -> str:
    """A compiler that hangs with a child; their process ids stand in ``folder``."""
    return script(
        folder / "cc-waits",
        ANSWERS,
        f"sleep 1000 & echo $! > '{folder}/child.new'; mv '{folder}/child.new' '{folder}/child'",
        "wait",
    )


def kept() -> list[Path]:
    """What lies in the cache folder."""
    return sorted(cache_folder().iterdir()) if cache_folder().exists() else []


def until(condition: Callable[[], bool], patience: float = 60.0) -> None:
    """Wait for something to become true."""
    end = time.monotonic() + patience
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.005)


def runs(pid: int) -> bool:
    """Whether a process is there and no zombie."""
    try:
        os.kill(pid, 0)
        return not Path(f"/proc/{pid}/stat").read_text().split(")")[-1].startswith(" Z")
    except (ProcessLookupError, FileNotFoundError):
        return False
