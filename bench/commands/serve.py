"""`motorbench serve`: the operator's panel in a browser."""

import logging
import socket
from ipaddress import ip_address
from pathlib import Path

from bench.errors import InputError, UsageError
from procedures.text import text


def serve(
    *,
    station: str = "",
    virtual: bool = False,
    host: str = "127.0.0.1",
    port: int = 8080,
    people: Path | None = None,
    runs: Path = Path("runs"),
    motors: Path = Path("motors"),
    plans: Path = Path("plans"),
    records: str = "records.sqlite",
) -> int:
    """Serve the panel until Ctrl-C; runs that go on then go on, and are found again at the next start.

    Parameters
    ----------
    station
        The station's file.
    virtual
        The virtual bench in place of a station.
    host
        The address to listen on; any other than loopback asks for a login and needs --people.
    port
        The port to listen on.
    people
        File of the people who may log in, made by motorbench user add.
    runs
        Folder of the runs.
    motors
        Folder of the motor files to choose from.
    plans
        Folder of the end of line's plans to choose from.
    records
        Where the end of line's records are kept, as motorbench eol run has it.

    """
    if virtual == bool(station):
        raise UsageError(text("give --station FILE, or --virtual for the virtual bench"))
    if station and not Path(station).is_file():
        raise InputError(text("{station}: there is no such station file", station=station))
    if not _is_loopback(host) and people is None:
        raise UsageError(
            text(
                "--host {host} opens the panel to a network, where everyone could start the motor; "
                "add --people FILE (motorbench user add makes it)",
                host=host,
            )
        )
    _check_free(host, port)
    from nicegui import ui

    from bench.panel.access import Access
    from bench.panel.app import build
    from bench.panel.panel import Panel

    build(Panel(runs, station or "virtual", motors, plans, records), Access(people) if people else None)
    logging.getLogger("uvicorn.error").setLevel(logging.WARNING)
    ui.run(
        host=host,
        port=port,
        title="motorbench",
        reload=False,
        show=False,
        show_welcome_message=False,
        favicon="⚙️",
    )
    return 0


def _check_free(host: str, port: int) -> None:
    if not 0 < port < 1 << 16:
        raise UsageError(text("--port {port}: allowed are 1 to 65535", port=port))
    try:
        socket.create_server((host, port), family=socket.AF_INET6 if ":" in host else socket.AF_INET).close()
    except OSError as error:
        raise InputError(
            text(
                "{host}:{port} cannot be listened on: {strerror}; choose another with --port or --host",
                host=host,
                port=port,
                strerror=error.strerror,
            )
        ) from error


def _is_loopback(host: str) -> bool:
    try:
        return host == "localhost" or ip_address(host).is_loopback
    except ValueError:
        raise UsageError(text("--host {host}: give an IP address", host=host)) from None
