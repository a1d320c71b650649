"""A session: the folder in memory through which the processes of a bench find one another."""

from __future__ import annotations

import dataclasses
import json
import os
import shutil
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from alight.errors import AlightError
from alight.files import FileError, whole_file
from alight.live.shared.commands import CommandBox
from alight.live.shared.ring import TelemetryRing
from alight.live.shared.status import open_status
from alight.scenarios import Scenario
from alight.scenarios.load import from_data, split_sources
from alight.symbolic.signals import Layout, Signal

MEMORY = Path("/dev/shm")
PREFIX = "alight-"


def place_of_sessions() -> Path:
    """Folder in which those of sessions stand: in memory where the system has one for that."""
    return MEMORY if os.access(MEMORY, os.W_OK) else Path(tempfile.gettempdir())


@dataclass(frozen=True)
class Settings:
    """What ``alight live`` was told."""

    scenario: dict[str, Any]
    """`Scenario.description`."""
    recordings: str
    """Folder of the recordings."""
    device: str | None = None
    """Configuration of real drives, a TOML file; the simulated testbed if absent."""
    seed: int = 0
    host: str = "127.0.0.1"
    port: int = 8080
    token: str | None = None
    core: int | None = None
    """Processor core of the host; the last one if absent."""
    budget: int = 200
    """Deadlines that may be missed within a second before the host trips."""


@dataclass(frozen=True)
class Session:
    """One bench: its folder, and what it was told."""

    folder: Path
    settings: Settings

    @classmethod
    def create(cls, settings: Settings) -> Session:
        """Make the folder, in `place_of_sessions`."""
        made = cls(Path(tempfile.mkdtemp(prefix=PREFIX, dir=place_of_sessions())), settings)
        with whole_file(made.folder / "session.json") as file:
            file.write(json.dumps(dataclasses.asdict(settings)).encode())
        return made

    @classmethod
    def open(cls, folder: str | Path) -> Session:
        """Join the session of a folder.

        Raises
        ------
        FileError
            If there is none.
        """
        path = Path(folder) / "session.json"
        try:
            return cls(Path(folder), Settings(**json.loads(path.read_bytes())))
        except (OSError, ValueError, TypeError) as error:
            raise FileError(path, f"is no session: {error}") from error

    @property
    def scenario(self) -> Scenario:
        """The scenario that the bench was started with."""
        return scenario_of(self.settings.scenario)

    @property
    def hosts(self) -> list[Path]:
        """Folders of the hosts that have been ready, the newest last."""
        ready = [path.parent for path in self.folder.glob("host-*/telemetry.json")]
        return sorted(ready, key=lambda path: int(path.name.split("-")[1]))

    def next_host(self) -> Path:
        """Make the folder of another host."""
        number = 1 + max((int(p.name.split("-")[1]) for p in self.folder.glob("host-*")), default=0)
        made = self.folder / f"host-{number}"
        made.mkdir()
        return made

    def remove(self) -> None:
        """Remove the folder; processes that still map its files keep them."""
        shutil.rmtree(self.folder, ignore_errors=True)


@dataclass(frozen=True)
class Link:
    """Everything that a process shares with a host."""

    folder: Path
    layout: Layout
    ring: TelemetryRing
    commands: CommandBox
    status: Any

    @classmethod
    def open(cls, folder: Path) -> Link:
        """Attach to a host that is ready: one of `Session.hosts`."""
        content = json.loads((folder / "telemetry.json").read_bytes())
        layout = Layout({name: Signal(**signal) for name, signal in content.items()})
        return cls(
            folder,
            layout,
            TelemetryRing.open(folder / "ring"),
            CommandBox.open(folder / "commands"),
            open_status(folder / "status"),
        )

    @classmethod
    def wait(cls, session: Session, newer_than: Path | None = None, seconds: float = 60.0) -> Link:
        """Attach to the newest host, as soon as there is one.

        Raises
        ------
        AlightError
            If there is none in time.
        """
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            if session.hosts and session.hosts[-1] != newer_than:
                return cls.open(session.hosts[-1])
            time.sleep(0.02)
        raise AlightError(f"no host was ready within {seconds:g} s")

    def announce(self) -> None:
        """Say that the host is ready; its last step before the first tick."""
        content = {name: dataclasses.asdict(s) for name, s in self.layout.signals.items()}
        with whole_file(self.folder / "telemetry.json") as file:
            file.write(json.dumps(content).encode())


def scenario_of(description: dict[str, Any]) -> Scenario:
    """A scenario from its description, as recordings and sessions keep it."""
    from alight.scenarios.scenario import Provenance

    content = {key: value for key, value in description.items() if key not in ("name", "seed")}
    sources = {path: Provenance(**source) for path, source in content.pop("provenance", {}).items()}
    values, _ = split_sources(content)
    if "seed" in description:
        values["seed"] = description["seed"]
    return from_data(values, str(description["name"]), sources)
