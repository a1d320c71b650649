"""What a file says about the recording in it: verdict, units, meanings, scenario."""

from __future__ import annotations

import dataclasses
import functools
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import pydantic

import alight
from alight.errors import AlightError, UnknownName
from alight.files import FileError
from alight.simulation.recording import Recording
from alight.simulation.recording_events import Event
from alight.simulation.verdict import Outcome, Verdict
from alight.symbolic.parameters import problems_of
from alight.symbolic.signals import Layout, Signal

KEY = "alight"
"""Under this key the description stands among the metadata of a file."""
FORMAT = 1
"""Rises when older versions of Alight could no longer read what is written."""
TIME = Signal("s", "time of each sample")


def _outcome(name: object) -> Outcome:
    known = Outcome.__members__
    if name not in known:
        raise UnknownName("outcome", name, known)
    return known[str(name)]


@dataclass(frozen=True)
class _StoredVerdict:
    outcome: Annotated[Outcome, pydantic.BeforeValidator(_outcome)]
    time: float
    signal: str | None
    cause: str | None


@dataclass(frozen=True)
class _Stored:
    format: int
    version: str
    samples: int | None
    verdict: _StoredVerdict
    layout: dict[str, Signal]
    scenario: dict[str, Any]
    events: list[Event] = field(default_factory=list)
    bench: dict[str, Any] = field(default_factory=dict)


@functools.cache
def _adapter() -> pydantic.TypeAdapter[_Stored]:
    return pydantic.TypeAdapter(_Stored)


def description_of(recording: Recording, events: bool = True) -> str:
    """Everything about a recording but its numbers, as JSON; its events are left out on request.

    Numbers that are not finite stand as ``NaN`` and ``Infinity``; a scenario of Alight's own
    laws has none.

    Raises
    ------
    AlightError
        If the scenario holds something that is not plain data.
    """
    known = (recording.layout, recording.verdict, recording.scenario, recording.bench)
    return Description(len(recording), *known, recording.events if events else ()).as_json()


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return dict(value)
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    raise TypeError(f"its scenario holds {value!r}; numbers, texts, lists and tables are allowed")


def names_and_numbers(recording: Recording) -> tuple[list[str], np.ndarray]:
    """Name of each column, time first, and the columns as one float64 matrix.

    Raises
    ------
    AlightError
        If two columns bear the same name, or the numbers do not fit the layout.
    """
    names = ["t", *recording.columns]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise AlightError(
            f"the recording has more than one column {', '.join(twice)}; rename a signal "
            "(t is the time, and entries of a vector carry an index from 1)"
        )
    t = np.asarray(recording.t, dtype=np.float64)
    samples = np.asarray(recording.samples, dtype=np.float64)
    expected = (len(t), len(names) - 1)
    if t.ndim != 1 or samples.shape != expected:
        raise AlightError(
            f"samples have the shape {samples.shape}; t and layout ask for {expected}"
        )
    return names, np.column_stack([t, samples])


@dataclass(frozen=True)
class Description:
    """What a file says about the recording in it."""

    samples: int | None
    """How many there are; None while they are being recorded."""
    layout: Layout
    verdict: Verdict
    scenario: Mapping[str, Any]
    bench: Mapping[str, Any] = field(default_factory=dict)
    events: tuple[Event, ...] = ()
    """Only where the file has no better place for them."""

    def as_json(self) -> str:
        """The description as JSON.

        Raises
        ------
        AlightError
            If the scenario holds something that is not plain data.
        """
        verdict = self.verdict
        content = {
            "format": FORMAT,
            "version": alight.__version__,
            "samples": self.samples,
            "verdict": {
                "outcome": verdict.outcome.name,
                "time": verdict.time,
                "signal": verdict.signal,
                "cause": verdict.cause,
            },
            "layout": {n: dataclasses.asdict(s) for n, s in self.layout.signals.items()},
            "scenario": self.scenario,
            **({"bench": self.bench} if self.bench else {}),
            **({"events": [event.as_dict() for event in self.events]} if self.events else {}),
        }
        try:
            return json.dumps(content, default=_plain)
        except (TypeError, ValueError) as error:
            raise AlightError(f"the recording cannot be described as JSON: {error}") from error

    @classmethod
    def read(cls, text: str | bytes, path: Path) -> Description:
        """Read the JSON back; ``path`` stands in error messages.

        Raises
        ------
        FileError
            If a newer version of Alight wrote it, or something in it is missing or strange.
        """
        content = json.loads(text)
        if isinstance(content, dict) and content.get("format", FORMAT) != FORMAT:
            raise FileError(
                path,
                f"was written in format {content['format']} by Alight {content.get('version')}; "
                f"this is Alight {alight.__version__}, which reads format {FORMAT}",
            )
        try:
            stored = _adapter().validate_python(content)
        except pydantic.ValidationError as error:
            lines = "; ".join(problems_of(error))
            raise FileError(path, f"its description of the recording is wrong: {lines}") from None
        ending = stored.verdict
        return cls(
            samples=stored.samples,
            layout=Layout(stored.layout),
            verdict=Verdict(ending.outcome, ending.time, ending.signal, ending.cause),
            scenario=stored.scenario,
            bench=stored.bench,
            events=tuple(stored.events),
        )

    @property
    def names(self) -> list[str]:
        """Name of each column, time first."""
        return ["t", *self.layout.columns]

    def recording(self, numbers: np.ndarray, path: Path) -> Recording:
        """The recording with these numbers: one column for each of ``names``.

        Raises
        ------
        FileError
            If samples or columns are missing.
        """
        expected = (self.samples, len(self.names))
        if numbers.shape != expected:
            raise FileError(
                path,
                f"holds {numbers.shape[0]} samples of {numbers.shape[1]} columns where its "
                f"description promises {expected[0]} of {expected[1]}; part of it is missing",
            )
        return self.of(numbers)

    def of(self, numbers: np.ndarray) -> Recording:
        """The recording with these numbers, however many there are."""
        return Recording(
            t=numbers[:, 0].copy(),
            samples=numbers[:, 1:],
            layout=self.layout,
            verdict=self.verdict,
            scenario=self.scenario,
            events=self.events,
            bench=self.bench,
        )
