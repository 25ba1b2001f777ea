"""Relays with a watchdog by the names that station files use; importing this imports no transport library."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from drivers.delta.options import BeckhoffRelayOptions
from drivers.interfaces import WatchdogRelay


@dataclass(frozen=True)
class RelayDriver:
    """One driver: its options' class, and how the relay is opened at an address."""

    name: str
    options: type[Any]
    opener: Callable[..., WatchdogRelay]

    def open(self, address: str, options: object, *, name: str) -> WatchdogRelay:
        """Open the relay; `name` stands for it in messages. Raises what the driver's own opener raises."""
        return self.opener(address, options, name=name)


def _open_beckhoff(address: str, options: BeckhoffRelayOptions, *, name: str) -> WatchdogRelay:
    from drivers.beckhoff.bk9000 import open_beckhoff_relay

    return open_beckhoff_relay(address, options, name=name)


RELAYS: tuple[RelayDriver, ...] = (RelayDriver("beckhoff-bk9000", BeckhoffRelayOptions, _open_beckhoff),)


def find_relay(name: str) -> RelayDriver:
    """Return the driver of a name; raises KeyError naming those there are."""
    for driver in RELAYS:
        if driver.name == name:
            return driver
    raise KeyError(f"no driver '{name}' for a relay with a watchdog; there are {', '.join(relay_names())}")


def relay_names() -> tuple[str, ...]:
    """Return the names of the drivers."""
    return tuple(driver.name for driver in RELAYS)
