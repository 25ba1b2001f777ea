"""Common parts of the commands that serve instruments: the addresses they may listen on, and messages about ports and clients."""

import ipaddress
import os
import sys
import threading
from queue import SimpleQueue
from typing import TYPE_CHECKING

from bench.i18n.errors import InputError, UsageError
from drivers.interfaces.text import reason_of, text

if TYPE_CHECKING:
    from sim_instruments.server.endpoints import RefusedClient

#: At most so many ports are served.
_PORTS = 100


def check_ports(base_port: int | None) -> None:
    """Raise UsageError for a first port that leaves no room for the others."""
    if base_port is not None and not 1024 <= base_port <= 65535 - _PORTS:
        raise UsageError(text("--base-port {port}: allowed is 1024 to {most}", port=base_port, most=65535 - _PORTS))


def check_host(host: str) -> None:
    """Raise UsageError for what is no IPv4 address."""
    try:
        ipaddress.IPv4Address(host)
    except ValueError:
        raise UsageError(text("--host {host}: give an IPv4 address, like 127.0.0.1", host=host)) from None


def unavailable(error: OSError, host: str) -> InputError:
    """Return the message if serving is not possible: which port of which endpoint cannot be used, and what to do."""
    from sim_instruments.server.port_plan import PortError

    if not isinstance(error, PortError):
        return InputError(text("nothing can be served on {host}: {error}", host=host, error=reason_of(error)))
    if not error.port:
        return InputError(
            text(
                "the address {host} cannot be used: {reason}; give an address of this computer with --host",
                host=host,
                reason=reason_of(error),
            )
        )
    return InputError(
        text(
            "{host}:{port}, for {endpoint}, cannot be used: {reason}; end the program that uses the port, or "
            "choose other ports with --base-port (or --ports FILE)",
            host=error.host,
            port=error.port,
            endpoint=".".join(error.endpoint),
            reason=reason_of(error),
        )
    )


def say_refused(refused: "SimpleQueue[RefusedClient]") -> None:
    """Say on standard error, from now on, which clients were hung up on because there are as many as are served."""

    def say() -> None:
        while True:
            one = refused.get()
            said = f"motorbench: {'.'.join(one.endpoint)}: another client was hung up on; {one.most} are connected, the most there may be\n"
            # Unbuffered: at the interpreter's end nobody may hold the lock of a buffer that nobody reads.
            os.write(sys.stderr.fileno(), said.encode())

    threading.Thread(target=say, name="refused-clients", daemon=True).start()
