"""A station's relays with a watchdog: picked up before a role behind them is energised, fed from then on, and dropped out at the end."""

import threading
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager, suppress
from time import monotonic

from bench.i18n.errors import InputError, at
from bench.journal.events.instruments import Commanding, Energising
from bench.journal.events.safety import (
    GuardianEnd,
    GuardianStart,
    WatchdogRelayDroppedOut,
    WatchdogRelayLost,
    WatchdogRelayPickedUp,
)
from bench.safety.guardian.link import Guard
from bench.safety.interrupts import Interrupts
from bench.station.watchdog_relay_entries import RelayEntry
from drivers.interfaces import CommunicationError, InstrumentError, ReportedError, WatchdogRelay
from drivers.interfaces.text import Text, text, text_of
from procedures.core.bench import Recorder, Role
from procedures.core.events import Event

#: A relay is fed so often within its time: two may be lost.
_FEEDS = 4
#: How long (s) the shutdown has before the contact opens under it, whatever keeps it.
_WAY_DOWN = 2.0


class FedRelay:
    """One relay of a run; opens the connection when this is made. Raises InstrumentError where nobody answers there."""

    def __init__(self, entry: RelayEntry) -> None:
        self._entry = entry
        self._relay = open_relay(entry)
        self._ending = threading.Event()
        self._thread: threading.Thread | None = None
        #: When (s, monotonic) the contact opens although the shutdown has not ended.
        self._latest: float | None = None
        self._touched = self._dropped = False

    @property
    def roles(self) -> frozenset[Role]:
        """The roles behind its contact."""
        return self._entry.roles

    def pick_up(self, recorder: Recorder, interrupts: Interrupts) -> None:
        """Close the contact and begin to feed, where that has not been done; the run is interrupted once it is lost.

        Raises InstrumentError where it has dropped out or refuses.
        """
        if self._dropped:
            raise ReportedError(
                f"watchdog relay {self._entry.name}", text("has dropped out"), remedy=text("Begin again")
            )
        if self._thread is not None:
            return
        self._touched = True
        self._relay.pick_up()
        self._thread = threading.Thread(
            target=self._feed, args=(recorder, interrupts), name=f"watchdog relay {self._entry.name}", daemon=True
        )
        self._thread.start()
        watchdog = self._relay.watchdog
        recorder.record(WatchdogRelayPickedUp(relay=self._entry.name, time=watchdog.time, setting=watchdog.setting))

    def going_down(self) -> None:
        """Open the contact before long, even where the shutdown hangs."""
        self._latest = monotonic() + _WAY_DOWN

    def drop_out(self, recorder: Recorder | None = None) -> list[str]:
        """Stop feeding, open the contact and close the connection; return what failed. May be called twice."""
        self._ending.set()
        if self._thread is not None:
            self._thread.join()
        faults = []
        for end in (self._relay.drop_out, self._relay.close) if self._touched else (self._relay.close,):
            try:
                end()
            except InstrumentError as error:
                faults.append(str(error))
        if self._touched and recorder is not None:
            with suppress(OSError):
                recorder.record(WatchdogRelayDroppedOut(relay=self._entry.name, faults=faults))
        self._touched = False
        return faults

    def _feed(self, recorder: Recorder, interrupts: Interrupts) -> None:
        time = self._relay.watchdog.time
        fed = monotonic()
        while not self._ending.wait(time / _FEEDS):
            if self._latest is not None and monotonic() >= self._latest:
                # What is behind it has had its time; not to feed it is enough.
                return
            try:
                self._relay.feed()
            except CommunicationError as error:
                if monotonic() - fed >= time:
                    self._lost(error, recorder, interrupts)
                    return
            except InstrumentError as error:
                self._lost(error, recorder, interrupts)
                return
            else:
                fed = monotonic()

    def _lost(self, error: InstrumentError, recorder: Recorder, interrupts: Interrupts) -> None:
        self._dropped = True
        interrupts.request(_cause(self._entry.name, error))
        with suppress(OSError):
            recorder.record(WatchdogRelayLost(relay=self._entry.name, error=str(error)))


class RelayedGuard:
    """A run's guard with relays beside it: they pick up once the guard has allowed it, and drop out before it is dismissed.

    `brakes` are roles that are led to a standstill in the shutdown, for which they stay fed to its end.
    """

    def __init__(
        self,
        guard: Guard,
        relays: Sequence[FedRelay],
        brakes: Collection[Role],
        recorder: Recorder,
        interrupts: Interrupts,
    ) -> None:
        self._guard = guard
        self._relays = relays
        self._brakes = frozenset(brakes)
        self._recorder = recorder
        self._interrupts = interrupts

    def hear(self, event: Event) -> None:
        """Take an event of the journal.

        Raises Interrupted where nothing may be energised any more, InstrumentError where a relay refuses.
        """
        self._guard.hear(event)
        if isinstance(event, Energising | Commanding):
            for relay in self._relays:
                if event.instrument in {role.value for role in relay.roles}:
                    relay.pick_up(self._recorder, self._interrupts)

    def going_down(self) -> None:
        """Be told that the run carries out the shutdown itself."""
        for relay in self._relays:
            if not relay.roles & self._brakes:
                relay.going_down()
        self._guard.going_down()

    def dismiss(self, *, journal_lost: bool, unsafe: bool = False) -> Sequence[str]:
        """Open the contacts, then dismiss the guard; return what failed."""
        faults = [fault for relay in self._relays for fault in relay.drop_out(self._recorder)]
        return [*faults, *self._guard.dismiss(journal_lost=journal_lost, unsafe=unsafe)]

    def record_in(self, journal: Recorder) -> None:
        """Record the beginning of the guardian's own record in the journal."""
        self._guard.record_in(journal)

    def about(self) -> GuardianStart | None:
        """Return what a run's record says of its guardian."""
        return self._guard.about()

    def record_end(self) -> GuardianEnd | None:
        """Return where the guardian's own record ends."""
        return self._guard.record_end()


class Relays:
    """The relays that a run is concerned with, open and not picked up."""

    def __init__(self, relays: Sequence[FedRelay]) -> None:
        self._relays = relays

    def beside(self, guard: Guard, brakes: Collection[Role], recorder: Recorder, interrupts: Interrupts) -> Guard:
        """Return the run's guard with these beside it; `brakes` as for RelayedGuard."""
        return RelayedGuard(guard, self._relays, brakes, recorder, interrupts) if self._relays else guard


@contextmanager
def relays_ready(entries: Sequence[RelayEntry], roles: Collection[Role], source: str) -> Iterator[Relays]:
    """Give the relays behind which any of these roles is; at the end of the block all have dropped out.

    Raises InputError where one of them does not answer.
    """
    relays: list[FedRelay] = []
    try:
        for entry in entries:
            if entry.roles & frozenset(roles):
                try:
                    relays.append(FedRelay(entry))
                except InstrumentError as error:
                    raise InputError(at(source, text_of(error))) from error
        yield Relays(relays)
    finally:
        for relay in relays:
            relay.drop_out()


def open_relay(entry: RelayEntry) -> WatchdogRelay:
    """Open a station's relay. Raises InstrumentError where nobody answers there."""
    return entry.driver.open(entry.address, entry.options, name=f"watchdog relay {entry.name}")


def _cause(name: str, error: InstrumentError) -> Text:
    return text("the watchdog relay {name}, which is open or silent: {error}", name=name, error=error)
