"""`motorbench serve`: the operator's panel in a browser."""

import socket
import ssl
import sys
from ipaddress import ip_address
from pathlib import Path

from bench.cli.options import Runs
from bench.files.toml_file import read
from bench.i18n.errors import InputError, UsageError
from bench.i18n.language import language_of, translator
from bench.station.station_file import NO_STATION, VIRTUAL
from drivers.interfaces.text import lines, reason_of, text

#: Largest message (bytes) from a browser, the same that NiceGUI's pages keep to.
_LONGEST_MESSAGE = 1_000_000
#: How long (s) a browser may be out of reach before its page is dropped: a tablet that sleeps, a roaming between two access points.
_LONGEST_SILENCE = 10.0
#: Shortest idle time (min): tests and the impatient; below it nobody could log in.
_LEAST_IDLE = 0.02


def serve(
    *,
    station: str = "",
    virtual: bool = False,
    host: str = "127.0.0.1",
    port: int = 8080,
    people: Path | None = None,
    runs: Runs = Path("runs"),
    motors: Path = Path("motors"),
    plans: Path = Path("plans"),
    records: str = "records.sqlite",
    allow_host: tuple[str, ...] = (),
    certificate: Path | None = None,
    key: Path | None = None,
    trusted_proxy: tuple[str, ...] = (),
    session_idle: float = 30.0,
    session_length: float = 12.0,
) -> int:
    """Serve the panel until Ctrl-C; runs that go on then go on, and are found again at the next start.

    Parameters
    ----------
    station
        The station's file, or virtual for the virtual bench.
    virtual
        Use the virtual bench instead of a station; the same as --station virtual.
    host
        The address to listen on. Any address other than loopback requires a login, and so --people.
    port
        The port to listen on.
    people
        File of the people who may log in, made by motorbench user add.
    motors
        Folder of the motor files to choose from.
    plans
        Folder of the end-of-line plans to choose from.
    records
        Where the end-of-line records are kept; the same as --records of motorbench eol run.
    allow_host
        A further name or address that browsers call the panel by; may be given several times.
    certificate
        The server's certificate for TLS (PEM, with its chain). Give --key with it.
    key
        The certificate's private key (PEM, without a password).
    trusted_proxy
        The address of a reverse proxy whose X-Forwarded-For and X-Forwarded-Proto headers are trusted. May be given several
        times.
    session_idle
        Minutes without use after which a login ends.
    session_length
        Hours after which a login ends in any case.

    """
    station = VIRTUAL if virtual and not station else station
    if not station or (virtual and station != VIRTUAL):
        raise UsageError(text("give --station FILE, or --virtual for the virtual bench"))
    if station != VIRTUAL:
        read(Path(station), text("station file"), NO_STATION)
        _say_what_is_wrong(station)
    if not _is_loopback(host) and people is None:
        raise UsageError(
            text(
                "--host {host} opens the panel to the network, where anyone could start the motor; add --people "
                "FILE (motorbench user add creates the file)",
                host=host,
            )
        )
    _check_times(session_idle, session_length)
    _check_certificate(certificate, key)
    for address in trusted_proxy:
        _check_address(address)
    _check_free(host, port)
    from bench.panel.server.socket_server import load_socket_server

    load_socket_server()
    from nicegui import app, ui

    from bench.panel.app import build
    from bench.panel.panel import Panel
    from bench.panel.server.access import Access
    from bench.panel.server.hosts import AllowedHosts
    from bench.panel.server.server_log import quieten_server
    from bench.panel.server.sessions import Sessions, SessionTimes

    # Without a login there is nothing to end: the next request would begin the same again.
    times = SessionTimes(60.0 * session_idle, 3600.0 * session_length) if people else SessionTimes()
    panel = Panel(runs, station, motors, plans, records, Sessions(times), Access(people) if people else None)
    build(panel, AllowedHosts(host, allow_host))
    quieten_server()
    scheme, name = "https" if certificate else "http", _reached_by(host)
    where = text("The panel: {address} (Ctrl-C ends the panel; a run continues)", address=f"{scheme}://{name}:{port}")
    message = where.render(translator(language_of("auto")))
    app.on_startup(lambda: print(message, flush=True))
    ui.run(
        host=host,
        port=port,
        title="motorbench",
        reload=False,
        show=False,
        show_welcome_message=False,
        favicon="⚙️",
        # The panel's style sheet is at hand: no browser works it out.
        tailwind=False,
        # The quicker parser takes a request's head of any length.
        http="h11",
        ws_max_size=_LONGEST_MESSAGE,
        # A page that is dropped is loaded anew, and loses what was chosen on it.
        reconnect_timeout=_LONGEST_SILENCE,
        server_header=False,
        # Else every program of this computer could say where it comes from.
        proxy_headers=bool(trusted_proxy),
        forwarded_allow_ips=list(trusted_proxy),
        ssl_certfile=certificate,
        ssl_keyfile=key,
    )
    return 0


def _say_what_is_wrong(station: str) -> None:
    """Say on standard error why nothing can run on a station; the panel is served all the same, and reads the file anew for each run."""
    from bench.eol.line.preparation.line_file import load_line

    try:
        load_line(station, None)
    except InputError as error:
        after = text("Nothing can be run on this station until its file is corrected; the panel then reads it again")
        message = lines((error.text, after)).render(translator(language_of("auto")))
        print(f"motorbench: {message}", file=sys.stderr, flush=True)


def _reached_by(host: str) -> str:
    """Return what a browser calls the panel by; of every address at once, the computer's name."""
    everywhere = host in ("", "0.0.0.0", "::")  # noqa: S104  it is asked, not bound
    if everywhere:
        return socket.gethostname()
    return f"[{host}]" if ":" in host else host


def _check_times(idle: float, length: float) -> None:
    # Written so that a figure that is none is refused as well.
    if not (_LEAST_IDLE <= idle <= 60.0 * length):
        raise UsageError(
            text(
                "--session-idle {idle:g} (min) with --session-length {length:g} (h): allowed are {least:g} min and "
                "more, up to the session's length",
                idle=idle,
                length=length,
                least=_LEAST_IDLE,
            )
        )


def _check_certificate(certificate: Path | None, key: Path | None) -> None:
    if (certificate is None) != (key is None):
        raise UsageError(text("give --certificate and --key together, or neither"))
    if certificate is None or key is None:
        return
    try:
        ssl.create_default_context(ssl.Purpose.CLIENT_AUTH).load_cert_chain(certificate, key, password=_no_password)
    except (OSError, ValueError) as error:
        raise InputError(
            text(
                "--certificate {certificate} and --key {key} cannot be used: {error}; give a certificate and its key as "
                "PEM files, the key without a password",
                certificate=certificate,
                key=key,
                error=error,
            )
        ) from error


def _no_password() -> str:
    raise ValueError("the key asks for a password")


def _check_address(address: str) -> None:
    try:
        ip_address(address)
    except ValueError:
        raise UsageError(text("--trusted-proxy {address}: give an IP address", address=address)) from None


def _check_free(host: str, port: int) -> None:
    if not 0 < port < 1 << 16:
        raise UsageError(text("--port {port}: allowed are 1 to 65535", port=port))
    try:
        socket.create_server((host, port), family=socket.AF_INET6 if ":" in host else socket.AF_INET).close()
    except OSError as error:
        raise InputError(
            text(
                "the panel cannot listen on {host}:{port}: {strerror}; choose another address with --port or --host",
                host=host,
                port=port,
                strerror=reason_of(error),
            )
        ) from error


def _is_loopback(host: str) -> bool:
    try:
        return host == "localhost" or ip_address(host).is_loopback
    except ValueError:
        raise UsageError(text("--host {host}: give an IP address", host=host)) from None
