"""Supervision of interlocks: each contact on its own thread; listeners are called when one opens."""

import math
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict
from time import monotonic

from bench.i18n.errors import InputError, at
from bench.journal.events.safety import InterlockOpened, InterlocksStart
from bench.safety.interrupts import Interrupts
from bench.safety.ownership.state_folder import StateFolder
from bench.safety.trip_latch import Latch, Trip
from bench.station.interlock_entries import InterlockEntry
from bench.station.station_file import Station
from drivers.interfaces import InstrumentError, Interlock
from drivers.interfaces.text import Text, lines, text, text_of
from procedures.core.bench import Recorder

#: How often (s) a contact is read; one that is sent by itself is waited for.
_POLL = 0.01
#: How often (s) this process looks whether it gets its time, and how much later than that is late.
_TICK, _LATE = 0.05, 0.05

_OPEN = text("open")
#: Told the interlock's name and how it is: open, or silent and why.
Opened = Callable[[str, Text], None]


def state(interlock: Interlock) -> Text | None:
    """Return why a contact does not count as closed, None where it is closed."""
    try:
        return None if interlock.closed() else _OPEN
    except InstrumentError as error:
        return text("silent, which counts as open ({error})", error=error)


class Delays:
    """Detects when this process did not run: it was frozen, or the computer was."""

    def __init__(self, now: Callable[[], float] = monotonic) -> None:
        self._now = now
        self._ticked = now()
        self._late = -math.inf

    def tick(self) -> None:
        """Be called every `_TICK` (s)."""
        now = self._now()
        if now - self._ticked > _TICK + _LATE:
            self._late = now
        self._ticked = now

    def since(self, begun: float) -> bool:
        """Tell whether it was late at some time since `begun` (s, monotonic), even if the next tick has not come yet."""
        return self._late >= begun or self._now() - self._ticked > _TICK + _LATE


class Interlocks:
    """The contacts of a station, opened when this is made. Raises InstrumentError where one cannot be."""

    def __init__(self, entries: Iterable[InterlockEntry]) -> None:
        self._opened: dict[str, Interlock] = {}
        self._stopping = threading.Event()
        self._threads: list[threading.Thread] = []
        self._delays = Delays()
        try:
            for entry in entries:
                self._opened[entry.name] = entry.driver.open(
                    entry.address, entry.options, name=f"interlocks.{entry.name}"
                )
        except BaseException:
            self.close()
            raise

    @property
    def names(self) -> list[str]:
        """Their names."""
        return list(self._opened)

    def not_closed(self) -> list[tuple[str, Text]]:
        """Return name and state of every contact that does not count as closed now."""
        found = [(name, state(interlock)) for name, interlock in self._opened.items()]
        return [(name, how) for name, how in found if how]

    def watch(self, opened: Opened) -> None:
        """Call `opened` once for each contact that opens from now on, on the thread that has seen it."""
        self._delays.tick()
        self._start("interlock delays", self._tick)
        for name, interlock in self._opened.items():
            self._start(f"interlock {name}", self._watch, name, interlock, opened)

    def stop(self) -> None:
        """Stop the supervision: a contact that opens from now on is no longer reported."""
        self._stopping.set()

    def close(self) -> None:
        """Stop watching and let go of the contacts."""
        self.stop()
        for thread in self._threads:
            thread.join()
        for interlock in self._opened.values():
            interlock.close()

    def _start(self, name: str, work: Callable[..., None], *arguments: object) -> None:
        thread = threading.Thread(target=work, args=arguments, name=name, daemon=True)
        self._threads.append(thread)
        thread.start()

    def _tick(self) -> None:
        while not self._stopping.wait(_TICK):
            self._delays.tick()

    def _watch(self, name: str, interlock: Interlock, opened: Opened) -> None:
        while not self._stopping.is_set():
            begun = monotonic()
            how = state(interlock)
            if how not in (None, _OPEN) and self._delays.since(begun):
                # Whoever got no time himself has heard nothing meanwhile.
                how = state(interlock)
            if how:
                if not self._stopping.is_set():
                    opened(name, how)
                return
            self._stopping.wait(_POLL)


class WatchedInterlocks:
    """The interlocks of a station that may start, and where a trip is kept."""

    def __init__(self, interlocks: Interlocks, latch: Latch) -> None:
        self._interlocks = interlocks
        self._latch = latch

    def about(self) -> InterlocksStart:
        """Return what a run's record says of them at its beginning: their names, and a reset that no record holds yet."""
        reset = self._latch.take_reset()
        return InterlocksStart(self._interlocks.names, None if reset is None else asdict(reset))

    def watch(self, recorder: Recorder, interrupts: Interrupts) -> None:
        """End the run once one opens, and keep the station still until a person has reset it."""

        def opened(name: str, how: Text) -> None:
            interrupts.request(cause(name, how))
            not_kept = remember(self._latch, name, how)
            with suppress(OSError):
                recorder.record(InterlockOpened(interlock=name, how=str(how), not_kept=not_kept))

        self._interlocks.watch(opened)


class Uninterlocked:
    """Stands for the interlocks of a station that has none."""

    def about(self) -> InterlocksStart:
        """Return what a run's record says of them."""
        return InterlocksStart()

    def watch(self, recorder: Recorder, interrupts: Interrupts) -> None:
        """Pass."""


def remember(latch: Latch, name: str, how: Text) -> str | None:
    """Keep a trip; return why that failed, None where it did not."""
    try:
        latch.trip(name, str(how))
    except (OSError, InputError) as error:
        return str(text_of(error))
    return None


def it_is(how: Text) -> Text:
    """Return how a contact is that does not count as closed, in words."""
    return text("it is open") if how == _OPEN else text("it is {how}", how=how)


def _standing(name: str, how: Text) -> Text:
    if how == _OPEN:
        return text("the interlock {name} is open", name=name)
    return text("the interlock {name} is {how}", name=name, how=how)


def stood(trip: Trip) -> Text:
    """Return how an interlock was when it tripped, in words."""
    if trip.how == str(_OPEN):
        return text("the interlock {name} was open at {time}", name=trip.interlock, time=trip.wall)
    return text("the interlock {name} was {how} at {time}", name=trip.interlock, how=trip.how, time=trip.wall)


def cause(name: str, how: Text) -> Text:
    """Return what interrupts a run, in words."""
    if how == _OPEN:
        return text("the interlock {name}, which is open", name=name)
    return text("the interlock {name}, which is {how}", name=name, how=how)


@contextmanager
def ready(station: Station, state: StateFolder | None) -> Iterator[WatchedInterlocks | Uninterlocked]:
    """Give the interlocks of a station that may start; trips are kept in `state`, None for a bench in this process.

    Raises InputError where one is open or silent, which is a trip too, or has been open and nobody has reset it.
    """
    if state is None:
        if station.interlocks:
            raise ValueError("a station with interlocks needs a state folder")
        yield Uninterlocked()
        return
    latch = Latch(state, station)
    trip = latch.standing()
    if trip is not None:
        raise InputError(
            text(
                "{station}: {stood}, and it has not been reset. Find the cause, then: motorbench station reset "
                "{station} --by NAME",
                station=station.source,
                stood=stood(trip),
            )
        )
    if not station.interlocks:
        yield Uninterlocked()
        return
    latch.check_writable()
    with _opened(station) as interlocks:
        found = interlocks.not_closed()
        for name, how in found:
            latch.trip(name, str(how))
        if found:
            raise InputError(
                text(
                    "{station}: {said}. Close it, then: motorbench station reset {station} --by NAME",
                    station=station.source,
                    said=_all(found),
                )
            )
        yield WatchedInterlocks(interlocks, latch)


@contextmanager
def closed(station: Station) -> Iterator[Interlocks]:
    """Give the interlocks of a station, all of which are closed; raises InputError naming those that are not."""
    with _opened(station) as interlocks:
        found = interlocks.not_closed()
        if found:
            raise InputError(
                text("{station}: {said}. Close it, then start again", station=station.source, said=_all(found))
            )
        yield interlocks


@contextmanager
def _opened(station: Station) -> Iterator[Interlocks]:
    try:
        interlocks = Interlocks(station.interlocks)
    except InstrumentError as error:
        raise InputError(at(station.source, text_of(error))) from error
    try:
        yield interlocks
    finally:
        interlocks.close()


def _all(found: Iterable[tuple[str, Text]]) -> Text:
    return lines((_standing(name, how) for name, how in found), between="; ")
