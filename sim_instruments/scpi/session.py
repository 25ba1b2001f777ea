"""One client's dialogue with an instrument that several clients talk to."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from sim_instruments.scpi.errors import ScpiError
from sim_instruments.scpi.exchange import MessageExchange, ReadEnd
from sim_instruments.scpi.long_reply import LongReply
from sim_instruments.scpi.program import Message, ProgramReader

if TYPE_CHECKING:
    import numpy as np

    from sim_instruments.scpi.instrument import ScpiInstrument


#: A reply that is there as a whole is sent in parts of so many bytes.
_PART = 1 << 17


@dataclass(frozen=True)
class Outgoing:
    """A reply during transfer: its bytes in `parts`, iterated once, and whether they are the `whole` reply."""

    parts: Iterable[bytes]
    whole: bool


class ClientSession(MessageExchange):
    """Input and output of one client; settings, status and error queue are the instrument's, shared by all.

    A server that may not block asks `next_wake` how long to wait, and `take` for the reply. Either does one thing at most, so
    that a client whose messages take long has others served in between.
    """

    _at_once = False

    def __init__(self, instrument: "ScpiInstrument", generator: "np.random.Generator") -> None:
        super().__init__(instrument.clock, generator)
        self.tree = instrument.tree
        self._program = ProgramReader(instrument.tree)
        self.faults = instrument.faults
        self.connection = instrument.connection
        self.channels = instrument.channels
        self.terminator = instrument.terminator
        self.unasked = instrument.unasked
        self._instrument = instrument
        self._long: LongReply | None = None

    def report(self, error: ScpiError) -> None:
        """Put an error into the instrument's queue."""
        self._instrument.message = self.message
        self._instrument.report(error)

    def clear(self) -> None:
        """Device clear: forget this client's messages, and have the instrument give up what it waits for."""
        busy = self.busy
        self.abandon()
        self._instrument.give_up(busy)

    def abandon(self) -> None:
        """Forget this client's messages after it has disconnected; what it has started continues."""
        super().clear()
        self._long = None

    def status_byte(self, available: bool) -> int:
        """Return the instrument's status byte; `available` says whether this client has a reply to fetch."""
        return self._instrument.status_byte(available)

    def poll(self) -> None:
        """Do one thing that is due by now."""
        if self._working:
            return
        self._working = True
        try:
            # What an instrument has to catch up with is done in pieces before a message asks for all of it.
            if not self.busy or not self._instrument.catch_up():
                self._go_on()
        finally:
            self._working = False

    def service_reasons(self, available: bool) -> int:
        """Return the bits of the status byte for which the instrument asks this client for service."""
        return self._instrument.service_reasons(available)

    def next_wake(self) -> float | None:
        """Return the bench time (s) at which there is something to do or to send; None where nothing is to come."""
        self.poll()
        if self._output is not None:
            return self._ready
        if self._running is not None:
            return self._wake
        return self.clock.now() if self._backlog or self._long is not None else None

    def take(self) -> Outgoing | None:
        """Return the reply that is ready; None where there is none."""
        self.poll()
        if self._long is not None:
            long, self._long = self._long, None
            return Outgoing(_ended(long.parts, self.terminator), True)
        if self._output is None or self._ready > self.clock.now():
            return None
        output, reason = self.read(len(self._output), 0.0)
        return Outgoing(_cut(output), reason is ReadEnd.MESSAGE)

    def _begin(self, message: Message) -> None:
        if self._long is not None:
            self._long = None
            self.report(ScpiError(-410))
        super()._begin(message)

    def _streams(self, reply: LongReply) -> bool:
        self._ended, self._long = True, reply
        return True


def _ended(parts: Iterable[bytes], end: bytes) -> Iterator[bytes]:
    yield from parts
    yield end


def _cut(output: bytes) -> Iterable[bytes]:
    if len(output) <= _PART:
        return (output,)
    return (output[start : start + _PART] for start in range(0, len(output), _PART))
