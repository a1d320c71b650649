"""Saving and loading recordings; the suffix of the file says how."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from alight.files import FileError
from alight.simulation.mcap_file import load_mcap, save_mcap
from alight.simulation.parquet_file import load_parquet, save_parquet
from alight.simulation.recording import Recording

__all__ = ["load", "load_mcap", "load_parquet", "save", "save_mcap", "save_parquet"]

_SAVE: dict[str, Callable[[Recording, str | Path], None]] = {
    ".parquet": save_parquet,
    ".mcap": save_mcap,
}
_LOAD: dict[str, Callable[[str | Path], Recording]] = {
    ".parquet": load_parquet,
    ".mcap": load_mcap,
}


def save(recording: Recording, path: str | Path) -> None:
    """Save a recording as ``.parquet`` (see `save_parquet`) or ``.mcap`` (see `save_mcap`).

    Raises
    ------
    FileError
        If the suffix is another one, or the file cannot be written.
    """
    _SAVE[_suffix(path)](recording, path)


def load(path: str | Path) -> Recording:
    """Load a recording from a ``.parquet`` or ``.mcap`` file.

    Raises
    ------
    FileError
        If the suffix is another one, the file cannot be read, is damaged, or holds no recording.
    """
    return _LOAD[_suffix(path)](path)


def _suffix(path: str | Path) -> str:
    suffix = Path(path).suffix.lower()
    if suffix not in _SAVE:
        given = f"its suffix is {suffix!r}" if suffix else "it has no suffix"
        allowed = " or ".join(_SAVE)
        raise FileError(path, f"{given}; a recording is saved as {allowed}")
    return suffix
