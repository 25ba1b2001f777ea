"""A guardian's own connections to what can feed energy, and the shutdown over them."""

import threading
from collections.abc import Callable, Collection, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any, cast

from bench.safety.guardian.light_visa import give_arrays, load_visa
from bench.safety.instrument_threads import InstrumentThreads
from bench.safety.interrupts import Flag
from bench.safety.shutdown import Outcome, shut_down
from bench.station.clock import SystemClock
from bench.station.shutdown_sequence import OFF_BY, Item, ShutdownSequence
from bench.station.station_file import Entry, Station
from bench.station.visa_library import StationVisa
from drivers.catalogue import MANUAL, Surroundings
from drivers.interfaces import Instrument
from drivers.transport.can.buses import CanBuses
from procedures.core.bench import Recorder, Role

if TYPE_CHECKING:
    from pyvisa import ResourceManager

#: Roles that feed nothing by themselves and have their part in the shutdown all the same: a bridge's test level, relays.
_ALSO = (Role.LCR_METER, Role.SWITCH_MATRIX)
#: CAN interfaces that let several processes on the same bus (python-can's names), `slcan` by a gateway's socket only.
_SHARED_CAN = ("socketcan/", "udp_multicast/", "slcan/socket://")
#: How long (s) the list waits for an instrument before it goes on with the others.
_PATIENCE = 0.2


class GuardedInstruments:
    """The instruments of some roles; those that several may be connected to are opened by `open`, others when needed."""

    def __init__(self, station: Station, roles: Collection[Role]) -> None:
        self._station = station
        self._clock = SystemClock()
        self._visa = StationVisa(station.visa_library)
        self._lock = threading.Lock()
        self._can_buses = CanBuses()
        self._threads = InstrumentThreads()
        # A tachometer's serial line has one end only, which a frozen run may still hold.
        measuring = {item.role for item in station.way_down.items if item.measures} - {Role.TACHOMETER}
        wanted = {role for role in roles if role in OFF_BY or role in measuring or role in _ALSO}
        entries = {role: entry for role, entry in station.entries.items() if role in wanted}
        self._guarded = {
            role: _Deferred(partial(self._open, entry)) for role, entry in entries.items() if not _by_hand(entry)
        }
        # Before there is a thread that might import anything else.
        if any("::" in entries[role].address for role in self._guarded):
            load_visa()

    @property
    def roles(self) -> frozenset[Role]:
        """The roles that are guarded."""
        return frozenset(self._guarded)

    @property
    def items(self) -> tuple[Item, ...]:
        """Shutdown items of these roles."""
        return tuple(item for item in self._station.way_down.items if item.role in self._guarded)

    def open(self) -> dict[str, str]:
        """Open those that several may be connected to; return by role what kept one from being opened."""
        failed = {}
        for role, deferred in self._guarded.items():
            if role in OFF_BY and is_shared(self._station.entries[role].address):
                try:
                    deferred.open()
                except Exception as error:  # noqa: BLE001  it is tried again when it is needed
                    failed[role.value] = f"{type(error).__name__}: {error}"
        return failed

    def opened(self) -> list[str]:
        """Return the roles whose connection stands."""
        return [role.value for role, deferred in self._guarded.items() if deferred.is_open]

    def is_busy(self, role: Role) -> bool:
        """Tell whether an instrument has not answered yet what was begun before."""
        return self._threads.is_busy(role.value)

    def shut_down(
        self,
        items: Sequence[Item],
        recorder: Recorder,
        *,
        longest: float,
        hurry: bool = False,
        wanted: Callable[[Item], bool] | None = None,
    ) -> list[Outcome]:
        """Do these items as `shut_down` does; with `hurry`, those that measure look once."""
        hurrying = Flag()
        if hurry:
            hurrying.set()
        instruments = {role: cast("Instrument", deferred) for role, deferred in self._guarded.items()}
        return shut_down(
            ShutdownSequence(tuple(items)),
            instruments,
            recorder,
            self._clock,
            hurry=hurrying,
            patience=_PATIENCE,
            longest=longest,
            wanted=wanted,
            threads=self._threads,
        )

    def _open(self, entry: Entry) -> Instrument:
        result = Surroundings(self._clock, self._manager, can_buses=self._can_buses, guarding=True)
        try:
            return entry.driver.open(entry.address, entry.options, result, name=entry.name)
        finally:
            give_arrays()

    def _manager(self) -> "ResourceManager":
        with self._lock:
            return self._visa.manager()


class _Deferred:
    """Stands for an instrument that is opened when it is first used, and again where that failed."""

    def __init__(self, make: Callable[[], Instrument]) -> None:
        self._make = make
        self._instrument: Instrument | None = None

    @property
    def is_open(self) -> bool:
        return self._instrument is not None

    def open(self) -> None:
        if self._instrument is None:
            self._instrument = self._make()

    def __getattr__(self, name: str) -> Any:
        self.open()
        return getattr(self._instrument, name)


def is_shared(address: str) -> bool:
    """Tell whether a second process may be connected to an address while the first is.

    So it is on a network, a CAN gateway's included, and on a CAN bus of the operating system; a serial line and a USB
    instrument are one process'.
    """
    scheme, _, rest = address.partition("://")
    if rest:
        return scheme == "tcp" or (scheme == "can" and rest.startswith(_SHARED_CAN))
    return address.upper().startswith("TCPIP")


def needs_guardian(station: Station, roles: Collection[Role]) -> bool:
    """Tell whether any of these roles can feed energy without a person's hand."""
    return any(role in OFF_BY and not _by_hand(entry) for role, entry in station.entries.items() if role in roles)


def _by_hand(entry: Entry) -> bool:
    return entry.driver.name == MANUAL
