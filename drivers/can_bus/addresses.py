"""Addresses of nodes on CAN buses."""

from dataclasses import dataclass
from urllib.parse import parse_qs, urlsplit

from drivers.interfaces import CommunicationError

DEFAULT_BITRATE = 500_000


@dataclass(frozen=True)
class BusAddress:
    """One bus: `interface` and `channel` as python-can names them, `bitrate` in bit/s."""

    interface: str
    channel: str
    bitrate: int = DEFAULT_BITRATE


def parse_address(address: str, name: str) -> tuple[BusAddress, int]:
    """Return bus and node id of `can://interface/channel?node=5&bitrate=500000`; raises CommunicationError otherwise."""
    try:
        parts = urlsplit(address)
        settings = {key: values[-1] for key, values in parse_qs(parts.query).items()}
        node_id, bitrate = int(settings["node"]), int(settings.get("bitrate", DEFAULT_BITRATE))
    except (KeyError, ValueError):
        parts, node_id, bitrate = urlsplit(""), 0, 0
    channel = parts.path.removeprefix("/")
    if parts.scheme != "can" or not parts.netloc or not channel or not 1 <= node_id <= 127 or bitrate < 1:
        raise CommunicationError(
            name,
            f"'{address}' is no CAN address",
            remedy=f"Write can://interface/channel?node=1…127&bitrate={DEFAULT_BITRATE}",
        )
    return BusAddress(parts.netloc, channel, bitrate), node_id
