"""A station's instruments: each opened when first needed, limited by the motor, recorded, and closed on its own."""

from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import suppress
from functools import partial
from typing import Any

from bench.journal.errors import RecordError
from bench.journal.events.instruments import InstrumentFailed, InstrumentOpened, TrafficSeen
from bench.journal.recording import Recording, WaveformSink
from bench.safety.calls import CallWatches
from bench.safety.limits.bounds import Observer, limits_of, nobody
from bench.safety.limits.guard import PolePairs, guarded
from bench.safety.ownership.claims import Claim, identity_keys
from bench.safety.ownership.owner import HeldError, HeldInstrumentError, Ownership, Unowned
from bench.safety.watchdogs import watchdog_of
from bench.station.station_file import Entry, Station
from bench.station.visa_library import StationVisa
from bench.traffic.recorder import TrafficRecorder
from drivers.catalogue import Surroundings
from drivers.interfaces import UNWATCHED, Clock, Instrument, InstrumentError, Traffic
from drivers.interfaces.text import text
from drivers.manual.prompt import Prompt
from drivers.transport.can.buses import CanBuses
from drivers.transport.in_process import InProcess
from procedures.core.bench import Recorder, Role
from procedures.core.nameplate import Nameplate

#: Gives the way to the person for the instrument in a role; None where there is no person.
Prompts = Callable[[Role], Prompt | None]


class StationInstruments:
    """Opens, hands out and closes the instruments of a station.

    `visa` is the library of VISA instruments; `in_process` opens the addresses that
    a bench in this process has. With `trace`, every exchange of the drivers is an event too. Nobody gets an instrument
    without the motor's and the station's limits in front of it; `pole_pairs` gives what is known of them, `observe` hears
    every set point, `calls` watches over each exchange. `owner` has the instruments already; here it also gets them by their
    serial numbers. `traffic_recorder` takes down every call and every byte.
    """

    def __init__(
        self,
        station: Station,
        nameplate: Nameplate,
        clock: Clock,
        recorder: Recorder,
        waveforms: WaveformSink,
        visa: StationVisa,
        prompts: Prompts,
        *,
        in_process: InProcess | None = None,
        trace: bool = False,
        pole_pairs: PolePairs | None = None,
        observe: Observer = nobody,
        calls: CallWatches | None = None,
        owner: Ownership | None = None,
        traffic_recorder: TrafficRecorder | None = None,
    ) -> None:
        self._owner = owner or Unowned()
        self._station = station
        self._nameplate = nameplate
        self._waveforms = waveforms
        self._clock = clock
        self._recorder = recorder
        self._visa = visa
        self._prompts = prompts
        self._trace = trace
        self._pole_pairs = pole_pairs or (lambda: nameplate.pole_pairs)
        self._observe = observe
        self._calls = calls
        self._in_process = in_process
        self._traffic_recorder = traffic_recorder
        self._can_buses = CanBuses(in_process)
        self._opened: dict[Role, Instrument] = {}
        self._limited = {role: self._limit(role) for role in station.entries}

    def available(self) -> Mapping[Role, Instrument]:
        """Return one instrument for every role, behind the limits, recorded, and opened at its first use."""
        return {
            role: Recording(instrument, role.value, self._recorder, self._waveforms)
            for role, instrument in self._limited.items()
        }

    def open(self, role: Role) -> None:
        """Open the instrument of a role now; does nothing where the station has none. Raises InstrumentError."""
        if role in self._station.entries:
            self._bare(role)

    def get(self, role: Role) -> Instrument:
        """Return the instrument of a role, opened, behind the limits."""
        self._bare(role)
        return self._limited[role]

    def opened(self) -> Mapping[Role, Instrument]:
        """Return those that are open, with nothing in front: in the shutdown no reading may be refused."""
        return dict(self._opened)

    def silent(self) -> Collection[Role]:
        """Return the roles whose instrument did not answer its last call, as far as the calls are watched."""
        return self._calls.silent() if self._calls else ()

    def close(self, roles: Collection[Role] | None = None) -> Sequence[str]:
        """Close those of some roles, or all and the VISA library, each on its own; return what went wrong.

        What is closed opens again at its next use.
        """
        faults = []
        for role in list(self._opened) if roles is None else sorted(roles, key=lambda role: role.value):
            if role in self._opened:
                faults += _attempt(role.value, self._opened.pop(role).close)
        if roles is None:
            faults += _attempt("VISA library", self._visa.close)
        return faults

    def _limit(self, role: Role) -> Instrument:
        entry = self._station.entries[role]
        limits = limits_of(role, self._nameplate, entry.limits)
        lazy = _Lazy(lambda: self._bare(role))
        return guarded(
            role,
            lazy,
            entry.name,
            limits,
            pole_pairs=self._pole_pairs,
            observe=self._observe,
            driver=entry.driver.name,
        )

    def _bare(self, role: Role) -> Instrument:
        if role not in self._opened:
            self._opened[role] = self._open(self._station.entries[role])
        return self._opened[role]

    def _open(self, entry: Entry) -> Instrument:
        recorder = self._traffic_recorder
        said: dict[str, Any] = {"instrument": entry.role.value, "driver": entry.driver.name, "address": entry.address}
        surroundings = Surroundings(
            self._clock,
            self._visa.manager,
            self._prompts(entry.role),
            self._traffic(entry.role) if self._trace else None,
            self._calls.of(entry.role) if self._calls else UNWATCHED,
            self._can_buses,
            self._in_process,
            wire=recorder.wire(entry.role) if recorder else None,
        )
        opener = partial(entry.driver.open, entry.address, entry.options, surroundings, name=entry.name)
        try:
            instrument = recorder.opened(entry.role, opener) if recorder else opener()
        except Exception as error:
            self._recorder.record(InstrumentFailed(**said, call="open", error=f"{type(error).__name__}: {error}"))
            if not isinstance(error, ValueError | OSError | ImportError):
                raise
            raise InstrumentError(
                entry.name,
                text(
                    "cannot be opened at {address}: {error}", address=entry.address or text("no address"), error=error
                ),
                remedy=text(
                    "See address of [instruments.{role}] in {file}; motorbench doctor {file} says what this computer lacks to reach it",
                    role=entry.role.value,
                    file=self._station.source,
                ),
            ) from error
        try:
            self._own(entry, instrument)
            self._recorder.record(
                InstrumentOpened(**said, identity=instrument.identity, watchdog=watchdog_of(instrument))
            )
        except BaseException:
            # Nobody knows of it yet, so nobody else would close it.
            instrument.close()
            raise
        return instrument

    def _own(self, entry: Entry, instrument: Instrument) -> None:
        """Claim an instrument by its serial number too: it may be reached by several addresses."""
        keys = identity_keys(self._station, entry, instrument.identity)
        try:
            self._owner.claim([Claim(entry.name, keys)])
        except HeldError as error:
            raise HeldInstrumentError(entry.name, error) from error

    def _traffic(self, role: Role) -> Traffic:
        def told(direction: str, content: str) -> None:
            # A record that fails must not break off an exchange, least of all one that switches off; the next event raises it.
            with suppress(RecordError):
                self._recorder.record(TrafficSeen(instrument=role.value, direction=direction, content=content))

        return told


class _Lazy:
    """Stands for an instrument until it is first used."""

    def __init__(self, opened: Callable[[], Instrument]) -> None:
        self._opened = opened

    def __getattr__(self, attribute: str) -> Any:
        return getattr(self._opened(), attribute)


def _attempt(name: str, close: Callable[[], object]) -> list[str]:
    try:
        close()
    except Exception as error:  # noqa: BLE001  one that cannot be closed must not keep the next open
        return [f"{name} could not be closed: {error}"]
    return []
