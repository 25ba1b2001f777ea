"""A recording replayed through today's drivers: do they do the same, to the byte or up to numbers?"""

from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass
from functools import partial
from typing import Any

from pyvisa import ResourceManager

from bench.station.station_file import Entry
from bench.traffic.calls import END, FAIL, OPEN, RecordedCall, call_of
from bench.traffic.messages import key_for, message_of
from bench.traffic.recorder import TrafficRecorder
from bench.traffic.sessions import session_of
from bench.traffic.traffic_file import SessionRecording, TrafficLine, broken
from drivers.catalogue import Surroundings
from drivers.interfaces import Instrument, Role
from drivers.interfaces.text import Text, text, text_of
from drivers.transport.can.buses import CanBuses
from drivers.transport.wire import Carrier
from sim_instruments.clock.virtual_clock import VirtualClock
from sim_instruments.recorded.bench import RecordedBench


@dataclass(frozen=True)
class Difference:
    """The first line of a recording that today's driver does not repeat: None stands for nothing."""

    recorded: TrafficLine | None
    today: TrafficLine | None

    @property
    def place(self) -> Text:
        """The place in the file."""
        return text("line {line}", line=self.recorded.number) if self.recorded else text("after the last line")

    @property
    def before(self) -> Text:
        """The recorded line."""
        return _shown(self.recorded)

    @property
    def now(self) -> Text:
        """The line of today's driver in its place."""
        return _shown(self.today)


@dataclass(frozen=True)
class Replayed:
    """One instrument's replay: how many messages it was sent, the first difference if there is one, and today's lines."""

    role: Role
    messages: int
    difference: Difference | None
    lines: Sequence[TrafficLine]


def replay(recording: SessionRecording, *, tolerant: bool = False) -> Sequence[Replayed]:
    """Repeat the recorded calls with the drivers, each with its recorded instrument.

    `tolerant` of numbers in messages, and of what came of calls. Raises InputError where a driver is not to be had.
    """
    entries = recording.station().entries
    return [_replayed(recording, entries[role], tolerant) for role in recording.carriers]


def _replayed(recording: SessionRecording, entry: Entry, tolerant: bool) -> Replayed:
    role, clock = entry.role, VirtualClock()
    calls = list(_calls(recording, role))
    bench = RecordedBench({role.value: session_of(recording, role, tolerant=tolerant)}, clock)
    recorder = TrafficRecorder(clock.now)
    manager = ResourceManager(bench.visa_library)
    surroundings = Surroundings(
        clock, lambda: manager, can_buses=CanBuses(bench), in_process=bench, wire=recorder.wire(role)
    )
    opener = partial(entry.driver.open, bench.address(role.value), entry.options, surroundings, name=entry.name)
    session = _Session(entry, recorder, opener)
    try:
        for line, call in calls:
            clock.sleep(max(0.0, line.time - clock.now()))
            # What a call raises is among what is compared.
            with suppress(Exception):
                session.repeat(line.words, call)
        lines = recorder.lines(role)
    finally:
        session.close()
        bench.close()
    carrier = recording.carriers[role]
    difference = _first_difference(recording.of(role), lines, carrier, tolerant)
    if recording.unfinished and difference is not None and difference.recorded is None:
        # What the driver went on to do was not recorded any more.
        difference = None
    return Replayed(role, sum(line.kind == ">" for line in lines), difference, lines)


class _Session:
    """Repeats the calls of one instrument."""

    def __init__(self, entry: Entry, recorder: TrafficRecorder, opener: "partial[Instrument]") -> None:
        self._role, self._recorder, self._opener = entry.role, recorder, opener
        self._instrument: Instrument | None = None
        self._blocks: list[AbstractContextManager[Any]] = []

    def repeat(self, words: str, call: RecordedCall | None) -> None:
        """Make a call as it was recorded. Raises what the driver raises."""
        if call is not None:
            outcome = call.made(self._instrument)
            if call.block:
                outcome.__enter__()
                self._blocks.append(outcome)
        elif words == OPEN:
            self._instrument = self._recorder.opened(self._role, self._opener)
        elif words == FAIL:
            self._blocks.pop().__exit__(RuntimeError, RuntimeError("as when it was recorded"), None)
        else:
            self._blocks.pop().__exit__(None, None, None)

    def close(self) -> None:
        """Close what is still open."""
        with suppress(Exception):
            while self._blocks:
                self._blocks.pop().__exit__(None, None, None)
        if self._instrument is not None:
            with suppress(Exception):
                self._instrument.close()


def _calls(recording: SessionRecording, role: Role) -> Iterator[tuple[TrafficLine, RecordedCall | None]]:
    """Give the calls of one instrument; None for those of the recording's own: opening, and the end of a block."""
    for line in recording.of(role):
        if line.kind == "=":
            try:
                yield line, None if line.words in (OPEN, END, FAIL) else call_of(line.words, role)
            except ValueError as error:
                raise broken(recording.source, line.number, text_of(error)) from None


def _first_difference(
    recorded: Sequence[TrafficLine], today: Sequence[TrafficLine], carrier: Carrier, tolerant: bool
) -> Difference | None:
    kinds = "=>" if tolerant else "=>#"
    before, now = ([line for line in lines if line.kind in kinds] for lines in (recorded, today))
    key = key_for(carrier, tolerant=tolerant)
    for one, other in zip(before, now, strict=False):
        if one.kind != other.kind or _compared(one, carrier, key) != _compared(other, carrier, key):
            return Difference(one, other)
    if len(before) > len(now):
        return Difference(before[len(now)], None)
    return Difference(None, now[len(before)]) if len(now) > len(before) else None


def _compared(line: TrafficLine, carrier: Carrier, key: Any) -> bytes:
    if line.kind == ">":
        return bytes(key(message_of(carrier, line.content)))
    if line.kind == "=":
        # It is the recording's own call, if it is one at all.
        return line.content.partition(b"(")[0]
    # Words may be put better; which error it is stays.
    return line.content.partition(b":")[0] if line.content.startswith(b"raised ") else line.content


def _shown(line: TrafficLine | None) -> Text:
    return text("nothing") if line is None else Text("{line}", {"line": f"{line.kind} {line.words}"})
