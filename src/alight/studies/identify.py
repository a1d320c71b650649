"""Recovering what the paper leaves out: a global search for one plant for both experiments."""

from __future__ import annotations

import functools
import json
import os
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor, ProcessPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from alight.errors import AlightError
from alight.files import FileError, whole_file
from alight.models.arm import Elbow
from alight.scenarios.load import identification_of
from alight.studies.identified import Identified, write_identified
from alight.studies.misfit import evaluate, misfit
from alight.studies.unknowns import NAMES, point_of, values_at

POPULATION = 18
SPREAD = 0.01
"""Initial step of a search from a known start, as a share of each range."""
SPREAD_WIDE = 0.2
"""Initial step of a search from the best of the scouts."""
SCOUTS = 60
"""Random candidates among which a wide search finds its start."""

Progress = Callable[[float, str], None]


@dataclass
class Log:
    """Every generation of a search: what makes it resumable, and its result."""

    seed: int
    elbow: Elbow
    start: list[float] | None
    """Point from which the first search starts; random if none."""
    generations: list[list[float]] = field(default_factory=list)
    """Costs of each generation, in the order in which the search asked for them."""

    @classmethod
    def read(cls, path: Path) -> Log:
        """Read a log.

        Raises
        ------
        FileError
            If the file cannot be read or is no log of a search.
        """
        try:
            return cls(**json.loads(path.read_text("utf-8")))
        except OSError as error:
            raise FileError(path, f"cannot be read: {error.strerror}") from None
        except (ValueError, TypeError) as error:
            raise FileError(path, f"is no log of `alight identify`: {error}") from None

    def write(self, path: Path) -> None:
        """Write the log, whole or not at all."""
        with whole_file(path) as file:
            file.write(json.dumps(self.__dict__).encode())


def identify(
    out: str | Path,
    *,
    generations: int = 200,
    seed: int = 1,
    elbow: Elbow = "+",
    wide: bool = False,
    workers: int | None = None,
    progress: Progress | None = None,
) -> Identified:
    """Search for the plant, and write both experiments with it.

    A search that finds its log in the folder goes on where that one stopped: the costs recorded
    are told to the same sequence of random numbers, so that the result depends neither on how
    often it was interrupted nor on the number of workers.

    Parameters
    ----------
    out : str or Path
        Folder for ``identification.json`` (the log), ``experiment-1.toml`` and
        ``experiment-2.toml``; made if missing.
    generations : int
        Generations of the search in all, those of an earlier part included.
    seed : int
        Seed of the search.
    elbow : {"+", "-"}
        Sign of the second joint angle.
    wide : bool
        Start at random instead of at the plant of the shipped scenarios.
    workers : int, optional
        Processes that run candidates; as many as there are processors if absent.
    progress : callable, optional
        Called with the share that is done, and the best misfit.

    Returns
    -------
    Identified

    Raises
    ------
    AlightError
        If the folder cannot be written, or holds the log of another search.
    """
    folder = Path(out)
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / "identification.json"
    log = _log(path, seed, elbow, wide)
    with ProcessPoolExecutor(workers or os.cpu_count()) as pool:
        best = _search(log, path, generations, pool, progress or (lambda share, text: None))
    tuned = evaluate(values_at(best), elbow)
    found = Identified(tuned, elbow, len(log.generations), seed, wide)
    write_identified(folder, found)
    return found


def _log(path: Path, seed: int, elbow: Elbow, wide: bool) -> Log:
    start = None if wide else point_of(shipped_values()).tolist()
    if not path.exists():
        return Log(seed, elbow, start)
    log = Log.read(path)
    if (log.seed, log.elbow, log.start) != (seed, elbow, start):
        raise AlightError(
            f"{path} belongs to another search (seed {log.seed}, elbow {log.elbow}, "
            f"{'wide' if log.start is None else 'from a known plant'}); use its settings to go on "
            "with it, or another folder to start afresh"
        )
    return log


def shipped_values() -> dict[str, float]:
    """Values of the unknowns in the shipped scenarios, from their provenance.

    Raises
    ------
    AlightError
        If the shipped scenarios do not state them.
    """
    found: Mapping[str, Any] = identification_of("experiment-1").get("unknowns", {})
    if not found:
        raise AlightError("the shipped scenarios state no identified values; search wide instead")
    return {name: float(found[name]) for name in NAMES}


def _search(log: Log, path: Path, total: int, pool: Executor, progress: Progress) -> np.ndarray:
    """Ask, run and tell, generation by generation; the best point seen."""
    best, best_cost = np.full(len(NAMES), 0.5), np.inf
    for number, (asked, tell) in enumerate(_generations(log)):
        if number < len(log.generations):
            costs = log.generations[number]
        elif number < total:
            costs = list(pool.map(misfit, asked, [log.elbow] * len(asked)))
            log.generations.append(costs)
            log.write(path)
        else:
            break
        tell(costs)
        if min(costs) < best_cost:
            best_cost = min(costs)
            best = np.array(asked[int(np.argmin(costs))])
        progress(min((number + 1) / total, 1.0), f"misfit {best_cost:.3f}")
    return best


Generation = tuple[list[np.ndarray], Callable[[list[float]], None]]
"""Candidates, and what wants to know their costs."""


def _generations(log: Log) -> Iterator[Generation]:
    """Candidates of one CMA-ES search after another, the same for the same seed and costs."""
    rng = np.random.default_rng(log.seed)
    if log.start is not None:
        yield from _descent(log.start, SPREAD, rng)
    while True:
        scouts = list(rng.random((SCOUTS, len(NAMES))))
        found: list[float] = []
        yield scouts, found.extend
        yield from _descent(scouts[int(np.argmin(found))].tolist(), SPREAD_WIDE, rng)


def _descent(start: list[float], spread: float, rng: np.random.Generator) -> Iterator[Generation]:
    """One CMA-ES search until it stops by itself."""
    import cma

    options = {
        "bounds": [0, 1],
        "seed": int(rng.integers(1, 2**31)),
        "popsize": POPULATION,
        "verbose": -9,
        "tolfun": 1e-3,
        "tolx": 1e-4,
    }
    strategy = cma.CMAEvolutionStrategy(start, spread, options)
    while not strategy.stop():
        asked = strategy.ask()
        yield asked, functools.partial(strategy.tell, asked)
