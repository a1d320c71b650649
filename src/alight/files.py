"""Files that are written whole or not at all, and errors that name the file."""

from __future__ import annotations

import contextlib
import os
import secrets
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from alight.errors import AlightError


class FileError(AlightError):
    """A file that cannot be written, cannot be read, or is not what it should be."""

    def __init__(self, path: str | Path, problem: str) -> None:
        self.path = Path(path)
        self.problem = problem
        super().__init__(f"{path}: {problem}")


@contextlib.contextmanager
def whole_file(path: str | Path) -> Iterator[BinaryIO]:
    """Open a file for writing that appears under its name only when it is complete.

    The content goes to a temporary file in the same folder, is forced to the disk, and takes
    the place of ``path`` in one step. On any error, an interrupt included, the temporary file
    is removed and what stood at ``path`` before is untouched. A symbolic link stays one: the
    file that it points at is replaced.

    Parameters
    ----------
    path : str or Path
        Where the file shall stand; its folder must exist.

    Yields
    ------
    BinaryIO
        To write the content to.

    Raises
    ------
    FileError
        If the folder is missing or refuses the file, the disk is full, or ``path`` is a folder,
        a device, or protected against writing.
    """
    temporary = ""
    try:
        target = os.path.realpath(path)
        mode = _mode_of_old(target, path)
        temporary = os.path.join(os.path.dirname(target), f".alight-{secrets.token_hex(8)}.tmp")
        with open(temporary, "xb") as file:
            if mode is not None:
                os.fchmod(file.fileno(), mode)
            yield file
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, target)
        temporary = ""
        force_folder(os.path.dirname(target))
    except OSError as error:
        raise FileError(path, f"cannot be written: {error.strerror or error}") from error
    finally:
        if temporary:
            with contextlib.suppress(OSError):
                os.unlink(temporary)


def _mode_of_old(target: str, path: str | Path) -> int | None:
    """Permissions of the file that will be replaced, None if there is none yet."""
    folder = os.path.dirname(target)
    try:
        is_folder = stat.S_ISDIR(os.stat(folder).st_mode)
    except FileNotFoundError:
        raise FileError(path, f"cannot be written: there is no folder {folder}") from None
    if not is_folder:
        raise FileError(path, f"cannot be written: {folder} is not a folder")
    try:
        found = os.stat(target)
    except FileNotFoundError:
        return None
    if not stat.S_ISREG(found.st_mode):
        raise FileError(path, "cannot be written: it is a folder or a device, not a file")
    # The folder alone decides about replacing; a file that is protected shall stay all the same.
    open(target, "r+b").close()
    return stat.S_IMODE(found.st_mode)


def force_folder(folder: str) -> None:
    """Force the names of a folder to the disk, where the file system can."""
    with contextlib.suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


@contextlib.contextmanager
def file_to_read(path: str | Path, kind: str) -> Iterator[BinaryIO]:
    """Open a file for reading; whatever goes wrong with it becomes a `FileError`.

    Parameters
    ----------
    path : str or Path
        The file.
    kind : str
        What the file should be, as in "a Parquet file".

    Yields
    ------
    BinaryIO
        To read from.

    Raises
    ------
    FileError
        If the file cannot be read, or a reader inside the block fails on its content.
    """
    with contextlib.ExitStack() as opened:
        try:
            file = opened.enter_context(open(path, "rb"))
        except OSError as error:
            raise FileError(path, f"cannot be read: {error.strerror}") from error
        try:
            yield file
        except AlightError:
            raise
        # Libraries fail on foreign bytes in many ways of their own: struct, zstd, key and
        # decoding errors among them. Each of them means the same to the user.
        except Exception as error:
            reason = str(error) or type(error).__name__
            raise FileError(path, f"is damaged, or is not {kind}: {reason}") from error
