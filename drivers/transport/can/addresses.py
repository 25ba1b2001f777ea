"""Addresses of nodes on CAN buses."""

import inspect
import re
from collections.abc import Collection
from dataclasses import dataclass, field, replace
from typing import Any
from urllib.parse import urlsplit

from drivers.interfaces import CommunicationError
from drivers.interfaces.text import text
from drivers.transport.in_process import IN_PROCESS
from drivers.transport.parameters import parameters_of, refuse_unknown

DEFAULT_BITRATE = 500_000


@dataclass(frozen=True)
class BusAddress:
    """One bus: `interface` and `channel` as python-can names them, `bitrate` in bit/s, and further `settings` of the interface."""

    interface: str
    channel: str
    bitrate: int = DEFAULT_BITRATE
    settings: tuple[tuple[str, str], ...] = field(default=())

    @property
    def on_network(self) -> bool:
        """Return whether it is reached through an slcan gateway at `socket://host:port`, which needs no time to start up."""
        return self.interface == "slcan" and self.channel.startswith("socket://")

    def arguments(self, waiting_time: float) -> dict[str, Any]:
        """Return what python-can opens it with; `waiting_time` is how long (s) one attempt to read waits.

        Raises ValueError for a setting that this interface does not have, ImportError or OSError where it is not installed.
        """
        named: dict[str, Any] = {"interface": self.interface, "channel": self.channel, "bitrate": self.bitrate}
        if self.on_network:
            named |= {"sleep_after_open": 0.0, "timeout": waiting_time}
        if self.settings:
            from can.util import cast_from_string

            given = dict(self.settings)
            refuse_unknown(given, {*settings_of_interface(self.interface), "bitrate", "node"})
            named |= {key: cast_from_string(value) for key, value in given.items()}
        return named


def settings_of_interface(interface: str) -> Collection[str]:
    """Return what can be set of an interface of python-can: what its class takes by name or documents, as far as text can say it.

    Raises ValueError for an interface that python-can has not, ImportError or OSError where it is not installed.
    """
    import can
    from can.interface import _get_class_for_interface as class_of

    try:
        made = class_of(interface)
    except (can.CanInterfaceNotImplementedError, NotImplementedError) as error:
        raise ValueError(text("interface {interface}: {error}", interface=interface, error=error)) from error
    named = set(inspect.signature(made.__init__).parameters)
    named |= set(re.findall(r":param (?:\S+ )?(\w+):", f"{made.__doc__ or ''}{made.__init__.__doc__ or ''}"))
    return sorted(named - {"self", "channel", "kwargs", "args", "timing", "can_filters", "state", "interface"})


def parse_address(address: str, name: str, bitrate: int = DEFAULT_BITRATE) -> tuple[BusAddress, int]:
    """Return bus and node id of `can://interface/channel?node=5&bitrate=500000`; raises CommunicationError otherwise.

    `bitrate` (bit/s) is that of an address which says none.
    """
    bus, settings = _parsed(address, bitrate)
    node_id = _number(settings.get("node", ""))
    if bus is None or not 1 <= node_id <= 127:
        raise CommunicationError(
            name,
            text("'{address}' is no CAN address", address=address),
            remedy=text("Write can://interface/channel?node=1…127&bitrate={bitrate}", bitrate=bitrate),
        )
    return bus, node_id


def with_flexible_data_rate(bus: BusAddress) -> BusAddress:
    """Return a bus as python-can opens it for CAN FD: with `fd=true` where its interface takes that and the address does not say it.

    One whose interface has CAN FD by itself (slcan) is told nothing.
    One of an interface that is not to be had is returned as it is: opening it says why.
    """
    try:
        known = settings_of_interface(bus.interface)
    except (ValueError, ImportError, OSError):
        return bus
    if "fd" not in known:
        return replace(bus, settings=tuple(one for one in bus.settings if one != ("fd", "true")))
    if "fd" in dict(bus.settings):
        return bus
    return replace(bus, settings=tuple(sorted((*bus.settings, ("fd", "true")))))


def parse_bus(address: str, name: str) -> BusAddress:
    """Return the bus of `can://interface/channel?bitrate=500000`; raises CommunicationError otherwise."""
    bus, _ = _parsed(address)
    if bus is None:
        raise CommunicationError(
            name,
            text("'{address}' is no address of a CAN bus", address=address),
            remedy=text("Write can://interface/channel?bitrate={bitrate}", bitrate=DEFAULT_BITRATE),
        )
    return bus


def _parsed(address: str, bitrate: int = DEFAULT_BITRATE) -> tuple[BusAddress | None, dict[str, str]]:
    try:
        parts = urlsplit(address)
        parameters = parameters_of(parts.query)
    except ValueError:
        return None, {}
    bitrate = _number(parameters.get("bitrate", str(bitrate)))
    channel = parts.path.removeprefix("/")
    if parts.scheme != "can" or not parts.netloc or not channel or bitrate < 1:
        return None, parameters
    further = tuple(sorted((key, value) for key, value in parameters.items() if key not in ("node", "bitrate")))
    if parts.netloc == IN_PROCESS and further:
        return None, parameters
    return BusAddress(parts.netloc, channel, bitrate, further), parameters


def _number(text: str) -> int:
    try:
        return int(text)
    except ValueError:
        return 0
