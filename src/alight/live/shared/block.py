"""A file in memory that several processes map: what they share without waiting for one another."""

from __future__ import annotations

import mmap
import os
import sys
from pathlib import Path

import numpy as np

from alight.files import FileError


def create_block(path: Path, dtype: np.dtype, count: int = 1) -> np.ndarray:
    """Make a file of zeros that holds ``count`` entries, and map it for reading and writing.

    It appears under its name when it has its whole size; every page of it has been touched, so
    that no later access waits for memory.

    Raises
    ------
    FileError
        If the file cannot be made.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    size = dtype.itemsize * count
    try:
        with open(temporary, "xb") as file:
            _reserve(file.fileno(), size)
        made = open_block(temporary, dtype)
        made.view(np.uint8)[:: mmap.PAGESIZE] = 0
        os.replace(temporary, path)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise FileError(path, f"cannot be shared: {error.strerror or error}") from error
    return made


def _reserve(descriptor: int, size: int) -> None:
    """Give a file its size: with memory behind it, or an error now, where the system can."""
    if sys.platform == "linux":
        os.posix_fallocate(descriptor, 0, size)
    else:
        os.ftruncate(descriptor, size)


def open_block(path: Path, dtype: np.dtype) -> np.ndarray:
    """Map a file that `create_block` made, as a one-dimensional array of its entries.

    The array holds the map; it stays valid when the file is removed.

    Raises
    ------
    FileError
        If there is no such file, or it does not hold whole entries.
    """
    try:
        with open(path, "r+b") as file:
            mapped = mmap.mmap(file.fileno(), 0)
    except (OSError, ValueError) as error:  # ValueError: the file is empty
        raise FileError(path, f"cannot be shared: {error}") from error
    if len(mapped) % dtype.itemsize:
        raise FileError(path, f"holds {len(mapped)} bytes, no multiple of {dtype.itemsize}")
    return np.frombuffer(mapped, dtype)
