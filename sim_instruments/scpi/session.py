"""One client's dialogue with an instrument that several clients talk to."""

from typing import TYPE_CHECKING

from sim_instruments.scpi.errors import ScpiError
from sim_instruments.scpi.exchange import MessageExchange, ReadEnd

if TYPE_CHECKING:
    import numpy as np

    from sim_instruments.scpi.instrument import ScpiInstrument


class ClientSession(MessageExchange):
    """Input and output of one client; settings, status and error queue are the instrument's, shared by all.

    A server that may not block asks `next_wake` how long to wait, and `take` for the reply.
    """

    def __init__(self, instrument: "ScpiInstrument", generator: "np.random.Generator") -> None:
        super().__init__(instrument.clock, generator)
        self.tree = instrument.tree
        self.faults = instrument.faults
        self.connection = instrument.connection
        self.channels = instrument.channels
        self.terminator = instrument.terminator
        self.unasked = instrument.unasked
        self._instrument = instrument

    def report(self, error: ScpiError) -> None:
        """Put an error into the instrument's queue."""
        self._instrument.message = self.message
        self._instrument.report(error)

    def clear(self) -> None:
        """Device clear: forget this client's messages, and have the instrument give up what it waits for."""
        busy = self.busy
        super().clear()
        self._instrument.give_up(busy)

    def abandon(self) -> None:
        """Forget this client's messages: it has gone; what it has set going goes on."""
        super().clear()

    def status_byte(self, available: bool) -> int:
        """Return the instrument's status byte; `available` says whether this client has a reply to fetch."""
        return self._instrument.status_byte(available)

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
        return None

    def take(self) -> tuple[bytes, bool] | None:
        """Return the reply that is ready and whether it is whole; None where there is none."""
        self.poll()
        if self._output is None or self._ready > self.clock.now():
            return None
        output, reason = self.read(len(self._output), 0.0)
        return output, reason is ReadEnd.MESSAGE
