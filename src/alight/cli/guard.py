"""What surrounds every command: its errors, Ctrl-C, warnings, and the streams it writes to."""

from __future__ import annotations

import contextlib
import errno
import functools
import logging
import os
import sys
import warnings
from collections.abc import Callable, Iterator
from typing import Any

import typer

from alight.errors import AlightError
from alight.files import FileError

FAILED, REFUSED, INTERRUPTED = 1, 2, 130
"""Exit codes: the run ended early, the input was refused, Ctrl-C."""


def add(app: typer.Typer, command: Callable[..., None], example: str) -> None:
    """Add a command: `guarded`, and with a worked example at the end of its help."""
    app.command(epilog=example_text(example))(guarded(command))


def example_text(example: str) -> str:
    """Return the last line of a help text."""
    return f"**Example:** {example}"


def guarded(command: Callable[..., None]) -> Callable[..., None]:
    """Make a command end with one message and an exit code where the user can mend what is wrong.

    An `AlightError` ends with code 2, Ctrl-C with 130. Whatever else goes wrong is a defect of
    Alight, or of the user's own law, and keeps its traceback.
    """

    @functools.wraps(command)
    def safe(*args: Any, **kwargs: Any) -> None:
        try:
            with _notes():
                command(*args, **kwargs)
                with writing_output():
                    sys.stdout.flush()
        except AlightError as error:
            _complain(f"error: {error}")
            raise typer.Exit(REFUSED) from None
        except MemoryError as error:
            _complain(f"error: out of memory: {error}; make duration shorter")
            raise typer.Exit(REFUSED) from None
        except BaseException as error:
            if not _is_interrupt(error):
                raise
            _complain("interrupted")
            raise typer.Exit(INTERRUPTED) from None

    return safe


def _is_interrupt(error: BaseException | None) -> bool:
    """Whether Ctrl-C is behind an error: CasADi may turn it into a SystemError."""
    return isinstance(error, KeyboardInterrupt) or (
        isinstance(error, SystemError) and _is_interrupt(error.__cause__)
    )


@contextlib.contextmanager
def writing_output() -> Iterator[None]:
    """Turn a full disk behind the standard output into an error with a name."""
    try:
        yield
    except OSError as error:
        if error.errno == errno.EPIPE:
            raise
        # What is left in the buffer would fail once more when the interpreter ends.
        with open(os.devnull, "w") as nowhere:
            os.dup2(nowhere.fileno(), sys.stdout.fileno())
        problem = f"cannot be written: {error.strerror or error}"
        raise FileError("standard output", problem) from None


@contextlib.contextmanager
def _notes() -> Iterator[None]:
    """Say each warning in one line, without the place in the code; on a terminal news as well."""

    def note(message: Warning | str, *_: Any, **__: Any) -> None:
        _complain(f"note: {' '.join(str(message).split())}")

    log, news = logging.getLogger("alight"), _News()
    level = log.level
    if sys.stderr.isatty():
        log.setLevel(logging.INFO)
        log.addHandler(news)
    try:
        with warnings.catch_warnings():
            warnings.showwarning = note
            yield
    finally:
        log.removeHandler(news)
        log.setLevel(level)


class _News(logging.Handler):
    """Says what Alight does that the user may wonder about, such as compiling."""

    def emit(self, record: logging.LogRecord) -> None:
        _complain(f"note: {record.getMessage()}")


def _complain(text: str) -> None:
    with contextlib.suppress(OSError):
        typer.echo(text, err=True)
