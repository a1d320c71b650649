"""C source to a library, built once and kept by content in the user's cache folder."""

from __future__ import annotations

import atexit
import contextlib
import ctypes
import hashlib
import logging
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import warnings
from pathlib import Path

from alight.kernels.compilers import Compiler, CompilerUnavailable, compilers, processor

ALWAYS = ("-fPIC", "-shared")
BUILD_LIMIT = 120.0
"""Seconds in which a compiler must be done."""
ABANDONED = 3600.0
"""Age [s] of a folder left by a build that was killed; far above `BUILD_LIMIT`."""
DAY = 86400.0
UNUSED = 90 * DAY
"""Age [s] of a library that nobody has asked for; the time of asking is kept to the day."""

_log = logging.getLogger("alight")


def library_of(source: str, *, flags: tuple[str, ...]) -> Path:
    """Path of a C source as a library: the kept one, or built now.

    Safe under concurrent processes and when killed: a library gets its name when it is whole and
    has been loaded once. Where the cache folder cannot be written it is built for this process
    only, with one warning.

    Parameters
    ----------
    source : str
        Self-contained C; the C library's mathematics is linked to it.
    flags : tuple of str
        In gcc's spelling; ``-march=native`` is translated for other compilers. What makes a
        shared library need not be said.

    Raises
    ------
    CompilerUnavailable
        If no compiler makes a library of it that can be loaded.
    """
    candidates = [(each, _name(source, flags, each)) for each in compilers()]
    if found := _kept([name for _, name in candidates]):
        return found
    folder, problems = _writable_folder(), []
    for compiler, name in candidates:
        try:
            return _build(source, flags, compiler, folder, name)
        except CompilerUnavailable as error:
            problems.append(str(error))
    raise CompilerUnavailable("; ".join(problems))


def is_kept(source: str, *, flags: tuple[str, ...]) -> bool:
    """Whether `library_of` would find a library and build nothing."""
    try:
        return _kept([_name(source, flags, each) for each in compilers()]) is not None
    except CompilerUnavailable:
        return False


def load(source: str, *, flags: tuple[str, ...]) -> ctypes.CDLL:
    """Load the library of a C source; one that was damaged or removed meanwhile is built anew.

    Raises
    ------
    CompilerUnavailable
        If there can be no such library; see `library_of`.
    """
    path = library_of(source, flags=flags)
    try:
        return ctypes.CDLL(str(path))
    except OSError:  # removed meanwhile, or of another world: a shared folder, a new C library
        with contextlib.suppress(OSError):
            path.unlink()
    path = library_of(source, flags=flags)
    try:
        return ctypes.CDLL(str(path))
    except OSError as error:
        raise _unloadable(error) from None


def tell_once(text: str) -> None:
    """Warn of what was lost, once in a process."""
    if text not in _told:
        _told.add(text)
        warnings.warn(text, stacklevel=3)


_told: set[str] = set()


# Where libraries are kept


def cache_folder() -> Path:
    """Folder for compiled programs: ``alight`` in the user's cache folder."""
    if sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches"
    else:
        given = Path(os.environ.get("XDG_CACHE_HOME", ""))
        base = given if given.is_absolute() else Path.home() / ".cache"
    return base / "alight"


def _kept(names: list[str]) -> Path | None:
    """The first of some libraries that is kept, be it for this process only."""
    folders = list(_passing)
    with contextlib.suppress(RuntimeError):  # there is no home at all
        folders.insert(0, cache_folder())
    paths = (path for folder in folders for name in names for path in folder.glob(f"{name}-*.so"))
    return next((path for path in paths if _is_sound(path)), None)


def _writable_folder() -> Path:
    """The cache folder if it takes files, else one that lasts as long as this process."""
    try:
        folder = cache_folder()
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return folder
    except (OSError, RuntimeError) as error:
        tell_once(f"compiled programs are not kept, so that each process compiles anew: {error}")
    try:
        if not _passing:
            _passing.append(Path(tempfile.mkdtemp(prefix="alight-")))
            atexit.register(shutil.rmtree, _passing[0], ignore_errors=True)
        _passing[0].mkdir(mode=0o700, exist_ok=True)
    except OSError as error:
        raise CompilerUnavailable(f"there is no folder for a compiled program: {error}") from None
    return _passing[0]


_passing: list[Path] = []
"""The folder that lasts as long as this process, if there is one."""


def _name(source: str, flags: tuple[str, ...], compiler: Compiler) -> str:
    """What a library is called for what it is made of; the digest of its content follows."""
    made_of = (source, *flags, "", *compiler.command, compiler.version, processor())
    return _digest(chr(0).join(made_of).encode())


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:32]


def _is_sound(path: Path) -> bool:
    """Whether a library is whole, and made by this user or the system; mark it as used.

    To load one that is cut short would kill the process.
    """
    try:
        state = path.stat()
        if state.st_uid not in (0, os.geteuid()):  # the code of somebody else is not run
            return False
        sound = path.stem.endswith(_digest(path.read_bytes()))
        if not sound:
            path.unlink()
        elif time.time() - state.st_mtime > DAY:
            os.utime(path)
    except OSError:
        return False
    return sound


def _sweep(folder: Path) -> None:
    """Remove what killed builds left, and what nobody has used for long."""
    now = time.time()
    for pattern, age in (("build-*", ABANDONED), ("*.so", UNUSED)):
        for path in folder.glob(pattern):
            with contextlib.suppress(OSError):
                if now - path.lstat().st_mtime > age:
                    shutil.rmtree(path) if path.is_dir() else path.unlink()


# Building


def _build(
    source: str, flags: tuple[str, ...], compiler: Compiler, kept_in: Path, name: str
) -> Path:
    """Compile into a folder of its own, try the result, and give it its name."""
    _log.info("compiling with %s, once: kept in %s", compiler.name, kept_in)
    _sweep(kept_in)
    try:
        with tempfile.TemporaryDirectory(
            dir=kept_in, prefix="build-", ignore_cleanup_errors=True
        ) as own:
            folder = Path(own)
            built = folder / "code.so"
            (folder / "code.c").write_text(source, "utf-8")
            _compile(compiler, flags, folder)
            _try(built)
            target = kept_in / f"{name}-{_digest(built.read_bytes())}.so"
            os.replace(built, target)
    except OSError as error:
        raise CompilerUnavailable(f"cannot build in {kept_in}: {error}") from None
    return target


def _compile(compiler: Compiler, flags: tuple[str, ...], folder: Path) -> None:
    """Run a compiler with all its children to their end, or to the limit of time."""
    spelled = compiler.spelled((*flags, *ALWAYS))
    command = [*compiler.command, *spelled, "code.c", "-o", "code.so", "-lm"]
    zig = {f"ZIG_{kind}_CACHE_DIR": str(folder.parent / "zig") for kind in ("GLOBAL", "LOCAL")}
    with open(folder / "said", "w+b") as said:
        child = subprocess.Popen(
            command,
            cwd=folder,
            env={**zig, **os.environ},
            stdin=subprocess.DEVNULL,
            stdout=said,
            stderr=subprocess.STDOUT,
            process_group=0,
        )
        try:
            code = child.wait(BUILD_LIMIT)
        except subprocess.TimeoutExpired:
            problem = f"{compiler.name} was not done after {BUILD_LIMIT:g} s"
            raise CompilerUnavailable(problem) from None
        finally:
            if child.returncode is None:
                with contextlib.suppress(ProcessLookupError):
                    os.killpg(child.pid, signal.SIGKILL)
                child.wait()
        if code:
            said.seek(0)
            words = " ".join(said.read(4000).decode(errors="replace").split())
            raise CompilerUnavailable(f"{compiler.name} failed: {words[:400] or f'code {code}'}")


def _try(built: Path) -> None:
    """Load a library before others see it, and have it on the disk before its name is."""
    try:
        ctypes.CDLL(str(built))
    except OSError as error:
        raise _unloadable(error) from None
    with open(built, "rb") as file:
        os.fsync(file.fileno())


def _unloadable(error: OSError) -> CompilerUnavailable:
    return CompilerUnavailable(
        f"what was compiled cannot be loaded: {error}; is the folder one that allows programs?"
    )
