"""Addresses of nodes on CAN buses."""

from dataclasses import dataclass
from typing import Any
from urllib.parse import parse_qs, urlsplit

from drivers.interfaces import CommunicationError
from drivers.interfaces.text import text

DEFAULT_BITRATE = 500_000


@dataclass(frozen=True)
class BusAddress:
    """One bus: `interface` and `channel` as python-can names them, `bitrate` in bit/s."""

    interface: str
    channel: str
    bitrate: int = DEFAULT_BITRATE

    @property
    def on_network(self) -> bool:
        """Whether it is reached through an slcan gateway at `socket://host:port`, which needs no time to start up."""
        return self.interface == "slcan" and self.channel.startswith("socket://")

    def arguments(self, waiting_time: float) -> dict[str, Any]:
        """Return what python-can opens it with; `waiting_time` is how long (s) one attempt to read waits."""
        named = {"interface": self.interface, "channel": self.channel, "bitrate": self.bitrate}
        return {**named, "sleep_after_open": 0.0, "timeout": waiting_time} if self.on_network else named


def parse_address(address: str, name: str) -> tuple[BusAddress, int]:
    """Return bus and node id of `can://interface/channel?node=5&bitrate=500000`; raises CommunicationError otherwise."""
    bus, settings = _parsed(address)
    node_id = _number(settings.get("node", ""))
    if bus is None or not 1 <= node_id <= 127:
        raise CommunicationError(
            name,
            text("'{address}' is no CAN address", address=address),
            remedy=text("Write can://interface/channel?node=1…127&bitrate={bitrate}", bitrate=DEFAULT_BITRATE),
        )
    return bus, node_id


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


def _parsed(address: str) -> tuple[BusAddress | None, dict[str, str]]:
    try:
        parts = urlsplit(address)
    except ValueError:
        return None, {}
    settings = {key: values[-1] for key, values in parse_qs(parts.query).items()}
    bitrate = _number(settings.get("bitrate", str(DEFAULT_BITRATE)))
    channel = parts.path.removeprefix("/")
    if parts.scheme != "can" or not parts.netloc or not channel or bitrate < 1:
        return None, settings
    return BusAddress(parts.netloc, channel, bitrate), settings


def _number(text: str) -> int:
    try:
        return int(text)
    except ValueError:
        return 0
