"""``alight live``: the bench."""

from __future__ import annotations

import importlib.util
import ipaddress
from pathlib import Path
from typing import Annotated

import typer

from alight.cli.options import ScenarioName, Seed, Settings
from alight.errors import AlightError

SHORTEST_TOKEN = 16
Recordings = Annotated[
    Path, typer.Option("--out", metavar="DIR", help="Folder of the recordings; made if missing.")
]
Drives = Annotated[
    Path | None,
    typer.Option(
        "--drives",
        metavar="FILE",
        help="Configuration of CAN drives, a TOML file; without it the testbed is simulated.",
    ),
]
Address = Annotated[
    str,
    typer.Option("--host", metavar="ADDR", help="Address of the page; any but loopback: --token."),
]
Token = Annotated[
    str | None,
    typer.Option(metavar="TOKEN", help="Secret that the page asks for, 16 characters or more."),
]
Port = Annotated[
    int, typer.Option(min=0, max=65535, metavar="N", help="Port of the page; 0 takes a free one.")
]
Core = Annotated[
    int | None,
    typer.Option(min=0, metavar="N", help="Processor core of the host; the last one if absent."),
]
Budget = Annotated[
    int,
    typer.Option(
        min=0,
        metavar="N",
        help="Deadlines that a run may miss within a second; more are a trip. Simulated drives on "
        "a slow computer want more.",
    ),
]


def live(
    scenario: ScenarioName,
    settings: Settings,
    out: Recordings = Path("recordings"),
    drives: Drives = None,
    host: Address = "127.0.0.1",
    token: Token = None,
    port: Port = 8080,
    core: Core = None,
    budget: Budget = 200,
    seed: Seed = None,
) -> None:
    """Run a scenario on the live bench: a hard-timed loop, and a page to watch and steer it.

    The page draws the bench and its signals, starts, stops and kicks it, and changes gains while
    it runs. Every run is recorded, one MCAP file each; *alight replay* shows it again. Ctrl-C
    ends the bench.
    """
    _refuse_open(host, token)
    if importlib.util.find_spec("nicegui") is None:
        raise AlightError("the page needs the package nicegui: pip install 'alight[live]'")
    from alight.cli.output import output_folder
    from alight.live import session, supervisor
    from alight.live.bank import Bank
    from alight.live.host.realtime import host_core
    from alight.scenarios import load_scenario

    chosen = load_scenario(scenario, settings)
    Bank.of(chosen)
    told = session.Settings(
        scenario=chosen.description(),
        recordings=str(out.absolute()),
        device=_device(drives, chosen.testbed.sample_rate),
        seed=chosen.document.seed if seed is None else seed,
        host=host,
        port=supervisor.free_port(host, port),
        token=token,
        core=host_core(core),
        budget=budget,
    )
    with output_folder(out):
        supervisor.supervise(told, lambda line: typer.echo(line, err=True))


def _device(drives: Path | None, sample_rate: float) -> str | None:
    """Path of the drives file; refuses here what the host could not use."""
    if drives is None:
        return None
    if not drives.is_file():
        raise AlightError(f"{drives}: there is no such file; --drives needs a TOML file")
    if importlib.util.find_spec("canopen") is None or importlib.util.find_spec("can") is None:
        raise AlightError(
            "--drives needs the packages canopen and python-can: pip install 'alight[drives]'"
        )
    from alight.live.devices.cia402.bus_load import check_loads
    from alight.live.devices.cia402.config import load_drives

    for line in check_loads(load_drives(drives), sample_rate, drives):
        typer.echo(f"warning: {line}", err=True)
    return str(drives.absolute())


def _refuse_open(host: str, token: str | None) -> None:
    """Refuse a page that anybody on the network could steer."""
    try:
        loopback = host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:
        loopback = False
    if token is None and not loopback:
        raise AlightError(
            f"--host {host}: whoever reaches that address could steer the bench; "
            f"give a --token of {SHORTEST_TOKEN} characters or more as well"
        )
    if token is not None and len(token) < SHORTEST_TOKEN:
        raise AlightError(f"--token: {len(token)} characters; {SHORTEST_TOKEN} or more are needed")
