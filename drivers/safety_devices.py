"""Declarations of drivers of watchdog relays and interlock contacts; importing this imports no transport library.

They are found by the entry-point groups `motorbench.watchdog_relays` and `motorbench.interlocks`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pkgutil import resolve_name
from typing import Any

from drivers.interfaces import InstrumentError, Interlock, WatchdogRelay
from drivers.interfaces.text import text
from drivers.transport.canonical_address import canonical_addresses


@dataclass(frozen=True)
class RelayDriver:
    """One driver of a relay with a watchdog.

    `options` is the dataclass of what a station file may say of it. `opener` is called with address, options and `name=`; written
    as `module:object` its module is imported when a relay is opened. `sources` says what it was written from, `commands_in`
    is the package whose `sources.toml` says it command by command.
    """

    name: str
    options: type[Any]
    opener: str | Callable[..., WatchdogRelay]
    sources: tuple[str, ...] = ()
    commands_in: str = ""

    def open(self, address: str, options: object, *, name: str) -> WatchdogRelay:
        """Open the relay; `name` stands for it in messages.

        Raises InstrumentError where what is opened is no WatchdogRelay, and what the driver's own opener raises.
        """
        relay: WatchdogRelay = _opened(self, WatchdogRelay, address, options, name)
        return relay


@dataclass(frozen=True)
class InterlockDriver:
    """One driver of interlock contacts; `options` and `opener` as for a RelayDriver.

    It takes contacts at addresses of its `schemes` where a station file names no driver. `contact` tells which contact it is
    behind an address, by its options, as station files that write the rest otherwise would say it too. `commands_in` as there.
    """

    name: str
    options: type[Any]
    opener: str | Callable[..., Interlock]
    schemes: tuple[str, ...] = ()
    contact: Callable[[str, Any], str] | None = None
    commands_in: str = ""

    def open(self, address: str, options: object, *, name: str) -> Interlock:
        """Open the contact; `name` stands for it in messages.

        Raises InstrumentError where what is opened is no Interlock, and what the driver's own opener raises.
        """
        interlock: Interlock = _opened(self, Interlock, address, options, name)
        return interlock

    def contact_names(self, address: str, options: Any) -> tuple[str, ...]:
        """Return the names of a contact; however its address is written, one contact has one in common."""
        contact = repr(options) if self.contact is None else self.contact(address, options)
        places = canonical_addresses(address, units=getattr(options, "units", ()))
        return tuple(f"{place} {contact}" for place in places)


def _opened(
    driver: RelayDriver | InterlockDriver, interface: type[Any], address: str, options: object, name: str
) -> Any:
    opener = resolve_name(driver.opener) if isinstance(driver.opener, str) else driver.opener
    result = _call(opener, driver, name, address, options, name=name)
    missing = [each for each in vars(interface) if not each.startswith("_") and each not in dir(result)]
    if missing:
        kinds = {"driver": driver.name, "kind": type(result).__name__, "interface": interface.__name__}
        raise InstrumentError(
            name,
            text(
                "what driver {driver} makes, {kind}, is no {interface}: it has no {missing}",
                missing=missing,
                **kinds,
            ),
        )
    return _Device(result, driver, name)


def _call(
    work: Callable[..., Any], driver: RelayDriver | InterlockDriver, name: str, /, *given: Any, **named: Any
) -> Any:
    """Return what a driver's own code returns. Raises InstrumentError in place of whatever else it raises."""
    try:
        return work(*given, **named)
    except InstrumentError:
        raise
    except (Exception, SystemExit) as error:
        kinds = {"driver": driver.name, "kind": type(error).__name__}
        raise InstrumentError(name, text("driver {driver}: {kind}: {error}", error=error, **kinds)) from error


class _Device:
    """A relay or a contact that raises nothing but InstrumentError: whoever watches it must not die of another's mistake."""

    def __init__(self, made: Any, driver: RelayDriver | InterlockDriver, name: str) -> None:
        self._made = made
        self._driver = driver
        self._name = name

    def __getattr__(self, attribute: str) -> Any:
        found = _call(getattr, self._driver, self._name, self._made, attribute)
        return partial(_call, found, self._driver, self._name) if callable(found) else found
