"""Checks of drivers for interlock contacts and watchdog relays, on a device or stand-in that the author provides."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass
from typing import Any

from bench.i18n.errors import InputError
from bench.plugins.catalogues import Catalogues, installed
from bench.station.clock import SystemClock
from bench.testing.conformance.driver import told
from bench.testing.conformance.report import Checks, ConformanceReport
from drivers.interfaces import InstrumentError, Interlock, WatchdogRelay
from drivers.safety_devices import InterlockDriver, RelayDriver

#: A contact is told right, or a silence noticed, within this time (s), of the wall's.
PATIENCE = 1.0
_STEP = 0.002


@dataclass(frozen=True)
class ContactPlace:
    """The place of a contact under test: `move` closes or opens it, `silent` gives a block in which nothing answers."""

    address: str
    move: Callable[[bool], None]
    silent: Callable[[], AbstractContextManager[Any]]


@dataclass(frozen=True)
class RelayPlace:
    """The place of a relay under test: `contact` tells whether it is closed, `silent` gives a block in which nothing answers."""

    address: str
    contact: Callable[[], bool]
    silent: Callable[[], AbstractContextManager[Any]]


def check_interlock(
    driver: InterlockDriver | str, place: ContactPlace, *, options: Any = None, catalogues: Catalogues | None = None
) -> ConformanceReport:
    """Check a driver of contacts, itself or by its name, at a contact that can be moved; takes a second of the wall's time.

    `options` are an instance of the driver's, or a mapping for it. Raises InputError for a driver that is not there.
    """
    if isinstance(driver, str):
        driver = (catalogues or installed()).interlocks.need(driver, lambda why: InputError(why))
    checks, made = Checks(), _options(driver, options)
    with told(checks, "contact"):
        names = driver.contact_names(place.address, made)
        checks.that("has a name", bool(names), "no name", "Give contact=, or an address that tells it")
        place.move(True)
        with _open(driver, place.address, made) as one, _open(driver, place.address, made) as other:
            for closed in (True, False, True, False):
                place.move(closed)
                for which, device in (("", one), (" by a second connection", other)):
                    _follows(checks, f"{'closed' if closed else 'open'} contact{which}", device, closed=closed)
            place.move(True)
            with place.silent():
                _is_noticed(checks, one)
            _follows(checks, "closed contact after a silence", one, closed=True)
            one.close()
        with place.silent():
            _never_there(checks, driver, place.address, made)
    return checks.report(f"{driver.name} (interlock)")


def check_watchdog_relay(
    driver: RelayDriver | str, place: RelayPlace, *, options: Any = None, catalogues: Catalogues | None = None
) -> ConformanceReport:
    """Check a driver of relays, itself or by its name, at a relay that drops out by itself; takes some five of its times.

    `options` are an instance of the driver's, or a mapping for it: give the shortest time that it takes. Raises InputError for a
    driver that is not there.
    """
    if isinstance(driver, str):
        driver = (catalogues or installed()).watchdog_relays.need(driver, lambda why: InputError(why))
    checks, made = Checks(), _options(driver, options)
    with told(checks, "relay"), _open(driver, place.address, made) as relay:
        time = relay.watchdog.time
        wanted = getattr(made, "watchdog_time", time)
        checks.that("watchdog's time", time == wanted > 0.0, f"{time} s instead of {wanted} s", "Give what is armed")
        _is(checks, "opened", relay, place, closed=False)
        relay.pick_up()
        _is(checks, "picked up", relay, place, closed=True)
        for _ in _quarters(1.25 * time, time):
            relay.feed()
            _is(checks, "fed four times within its time", relay, place, closed=True)
        for _ in _quarters(1.5 * time, time):
            with suppress(InstrumentError):
                relay.picked_up()
        _is(checks, "not fed, but asked", relay, place, closed=False)
        with checks.refuses(
            "fed after it has dropped out", InstrumentError, remedy="Ask whether it has before feeding"
        ):
            relay.feed()
        _is(checks, "fed after it has dropped out: the contact", relay, place, closed=False)
        for which in ("again", "once more"):
            relay.pick_up()
            _is(checks, f"picked up {which}", relay, place, closed=True)
            if which == "again":
                relay.drop_out()
                relay.drop_out()
            else:
                with _open(driver, place.address, made) as guardian:
                    _is(checks, "a second connection", guardian, place, closed=True)
                    guardian.drop_out()
            _is(checks, f"dropped out {which}", relay, place, closed=False)
        relay.pick_up()
        with place.silent():
            with checks.refuses("fed while nobody answers", InstrumentError, remedy="Raise CommunicationError"):
                relay.feed()
            for _ in _quarters(1.5 * time, time):
                continue
            checks.that("drops out while nobody answers", not place.contact(), "it is closed", "Arm the watchdog")
            _never_there(checks, driver, place.address, made)
        relay.close()
    return checks.report(f"{driver.name} (watchdog relay)")


def _options(driver: InterlockDriver | RelayDriver, options: Any) -> Any:
    return options if isinstance(options, driver.options) else driver.options(**(options or {}))


@contextmanager
def _open(driver: Any, address: str, options: Any) -> Iterator[Any]:
    device = driver.open(address, options, name="device")
    try:
        yield device
    finally:
        device.close()


def _follows(checks: Checks, check: str, device: Interlock, *, closed: bool) -> None:
    """Note whether a contact is told as it is before patience ends: what carries it may be sent now and then."""
    shown, clock = None, SystemClock()
    while clock.now() < PATIENCE and shown is not closed:
        with suppress(InstrumentError):
            shown = device.closed()
        clock.sleep(_STEP)
    checks.that(
        check, shown is closed, f"told as {shown}", "Read it afresh each time, and compare which level is closed"
    )


def _is_noticed(checks: Checks, device: Interlock) -> None:
    noticed, clock = False, SystemClock()
    while clock.now() < PATIENCE and not noticed:
        try:
            device.closed()
        except InstrumentError:
            noticed = True
        clock.sleep(_STEP)
    checks.that(
        "a silence", noticed, "the contact is told all the same", "Raise CommunicationError once nothing new comes"
    )


def _never_there(checks: Checks, driver: InterlockDriver | RelayDriver, address: str, options: Any) -> None:
    """Note whether a device that does not answer from the first is told."""
    with (
        checks.refuses("opened while nobody answers", InstrumentError, remedy="Raise CommunicationError"),
        _open(driver, address, options) as device,
    ):
        device.closed() if isinstance(driver, InterlockDriver) else device.picked_up()


def _is(checks: Checks, check: str, relay: WatchdogRelay, place: RelayPlace, *, closed: bool) -> None:
    found, shown = place.contact(), relay.picked_up()
    checks.that(
        check, found is shown is closed, f"contact {found}, told as {shown}, instead of {closed}", "See the relay"
    )


def _quarters(length: float, time: float) -> Iterator[None]:
    clock = SystemClock()
    while clock.now() < length:
        yield
        clock.sleep(time / 4.0)
