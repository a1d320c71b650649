"""Which C compilers this machine has, and how they are told what to do."""

from __future__ import annotations

import functools
import importlib.util
import os
import platform
import shlex
import shutil
import subprocess
import sys
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

from alight.errors import AlightError

NAMES = ("cc", "gcc", "clang")
ANSWER_LIMIT = 30.0
"""Seconds in which a compiler must say its version."""


class CompilerUnavailable(AlightError):
    """No working C compiler, or no folder to keep its output in."""


@dataclass(frozen=True)
class Compiler:
    """A C compiler: how it is called, and which one it is."""

    command: tuple[str, ...]
    version: str

    @property
    def name(self) -> str:
        """How a person calls it."""
        return "ziglang" if "ziglang" in self.command else self.command[0]

    @property
    def is_zig(self) -> bool:
        """Whether it is clang inside of Zig, whose flags for a processor differ."""
        return "ziglang" in self.command or Path(self.command[0]).name == "zig"

    def spelled(self, flags: tuple[str, ...]) -> tuple[str, ...]:
        """Flags, written as for gcc, in this compiler's spelling.

        ``-march=native`` is ``-mcpu=native`` for Zig everywhere and for clang on ARM. Without a
        flag for the processor Zig takes the present one, where others take the oldest of its kind:
        it is told to do the same.
        """
        arm_clang = "clang" in self.version and platform.machine() in ("arm64", "aarch64")
        if self.is_zig or arm_clang:
            flags = tuple("-mcpu=native" if f == "-march=native" else f for f in flags)
        if self.is_zig and not any(f.startswith(("-march=", "-mcpu=")) for f in flags):
            flags = (*flags, "-mcpu=baseline")
        return flags


def compilers() -> list[Compiler]:
    """Every C compiler found, the first the best: ``$CC`` alone if it is set.

    Otherwise those of `NAMES` on the path, then the package ``ziglang``.

    Raises
    ------
    CompilerUnavailable
        If there is none that says its version.
    """
    if chosen := os.environ.get("CC"):
        return [_answering(_split(chosen))]
    found: dict[str, Compiler] = {}
    problems: list[str] = []
    for path in filter(None, map(shutil.which, NAMES)):
        try:
            found.setdefault(os.path.realpath(path), _answering((path,)))
        except CompilerUnavailable as error:
            problems.append(str(error))
    made = list(found.values())
    if importlib.util.find_spec("ziglang") is not None:
        made.append(_ziglang())
    if not made:
        missing = f"no C compiler ({', '.join(NAMES)}) is on the path, nor is ziglang installed"
        raise CompilerUnavailable("; ".join(problems) or f"{missing} (pip install 'alight[zig]')")
    return made


def find_compiler() -> Compiler:
    """The compiler that is tried first; see `compilers`."""
    return compilers()[0]


def _split(chosen: str) -> tuple[str, ...]:
    """Words of ``$CC``, which may hold arguments; the first one as a path."""
    try:
        words = [chosen] if shutil.which(chosen) else shlex.split(chosen)
    except ValueError as error:
        raise CompilerUnavailable(f"CC={chosen} cannot be read: {error}") from None
    path = shutil.which(words[0]) if words else None
    if path is None:
        raise CompilerUnavailable(f"CC={chosen} is no program on the path; correct it or unset it")
    return (path, *words[1:])


def _answering(command: tuple[str, ...]) -> Compiler:
    try:
        changed = os.stat(command[0]).st_mtime_ns  # another one after an upgrade
    except OSError as error:
        raise CompilerUnavailable(f"{command[0]} cannot be read: {error}") from None
    version = _version(command, changed)
    if version is None:
        raise CompilerUnavailable(f"{shlex.join(command)} does not run")
    return Compiler(command, version)


@functools.cache
def _version(command: tuple[str, ...], changed: int) -> str | None:
    """What a compiler says of itself; None if it says nothing."""
    try:
        done = subprocess.run(
            [*command, "--version"],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=ANSWER_LIMIT,
            check=False,
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return None if done.returncode else f"{done.stdout}\n{changed}"


@functools.cache
def _ziglang() -> Compiler:
    return Compiler((sys.executable, "-m", "ziglang", "cc"), metadata.version("ziglang"))


@functools.cache
def processor() -> str:
    """The processor's kind and abilities, as far as machine code may depend on them."""
    try:
        lines = Path("/proc/cpuinfo").read_text("utf-8", "replace").splitlines()
    except OSError:
        lines = []
    entries = (line.partition(":") for line in lines)
    told = sorted({f"{k.strip()}={v.strip()}" for k, _, v in entries if k.strip() in _ABILITIES})
    return "\n".join([platform.system(), platform.machine(), *(told or [_brand()])])


_ABILITIES = (
    *("vendor_id", "cpu family", "model", "model name", "stepping", "flags"),
    *("CPU implementer", "CPU architecture", "CPU variant", "CPU part", "Features"),
)


def _brand() -> str:
    """The processor's name where there is no ``/proc/cpuinfo``: macOS."""
    command = ["sysctl", "-n", "machdep.cpu.brand_string"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=10, check=False)
    except (OSError, subprocess.SubprocessError):
        return platform.processor()
    return done.stdout.strip() or platform.processor()
