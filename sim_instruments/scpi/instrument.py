"""The common part of every SCPI instrument: identity, common commands, status, errors (IEEE 488.2, SCPI-99)."""

from collections.abc import Callable

import numpy as np

from sim_instruments.found_state import Leftovers, drawn
from sim_instruments.scpi.errors import ErrorQueue, ScpiError
from sim_instruments.scpi.exchange import InstrumentClock, MessageExchange
from sim_instruments.scpi.parameters import exactly, integer
from sim_instruments.scpi.status import StatusRegister
from sim_instruments.scpi.tree import Call, Handling, bare

_UNKNOWN_WORD = -141
POWER_ON, OPERATION_COMPLETE = 0x80, 0x01
MESSAGE_AVAILABLE, EVENT_SUMMARY, REQUEST = 0x10, 0x20, 0x40


class ScpiInstrument(MessageExchange):
    """Base of the faces that speak SCPI.

    A subclass gives the identity, adds its headers to `tree`, and overrides `reset` and, where operations overlap,
    `pending`. `queue_bit` is the bit of the status byte that shows a filled error queue, where the maker has one.
    `unknown_word` is the error for a word that a parameter does not take: -141 by the standard, -224 where the maker says so.
    """

    unknown_word = -141
    #: Whether there is *PSC.
    power_on_clears = False
    #: What a last user may have left, drawn in a hostile beginning.
    leftovers: Leftovers = ()

    def __init__(
        self,
        clock: InstrumentClock,
        generator: np.random.Generator,
        identity: str,
        *,
        queue_depth: int = 20,
        queue_bit: int = 0,
        version: str = "1999.0",
    ) -> None:
        super().__init__(clock, generator)
        self.identity = identity
        self.errors = ErrorQueue(queue_depth)
        self._queue_bit = queue_bit
        self._version = version
        self._event_status = POWER_ON
        self._event_enable = 0
        self._service_enable = 0
        self._power_on_clear = True
        self._opc_armed = False
        self._registers: list[tuple[int, StatusRegister]] = []
        #: Told of every error, with the message that it came of.
        self.on_error: Callable[[str, ScpiError], None] | None = None
        self._add_common()

    def reset(self) -> None:
        """Bring the settings to what the manual says of *RST."""
        raise NotImplementedError

    def leave(self, generator: np.random.Generator) -> tuple[str, ...]:
        """Bring the instrument into a state drawn from `leftovers`, and return the messages that did so."""
        sent = tuple(message for row in self.leftovers if (message := drawn(generator, row)))
        for message in sent:
            self.write(message.encode("ascii") + b"\n")
        self._clear_status()
        return sent

    def catch_up(self) -> bool:
        """Do a piece of what time has left to do, where that is much; return whether there is more."""
        return False

    def pending(self) -> float | None:
        """Return the virtual time at which to look again whether overlapped operations are done; None: they are."""
        return None

    def trigger(self) -> str | bytes | Handling | None:
        """Act on *TRG or a bus trigger. Raises ScpiError -211 where none is awaited."""
        raise ScpiError(-211)

    def options(self) -> str:
        """Return the reply to *OPT?."""
        return "0"

    def report(self, error: ScpiError) -> None:
        """Queue an error and set its bit in the standard event status register."""
        if error.number == _UNKNOWN_WORD != self.unknown_word:
            error = ScpiError(self.unknown_word)
        self._event_status |= error.event_bit
        self.errors.push(error)
        if self.on_error is not None:
            self.on_error(self.message, error)

    def add_register(self, header: str, register: StatusRegister, summary_bit: int) -> None:
        """Add a status register with its queries below a header; its summary shows in the status byte."""
        self._registers.append((summary_bit, register))

        def set_enable(call: Call) -> None:
            exactly(call.arguments, 1)
            register.enable = integer(call.arguments[0], 0, 65535)

        self.tree.add(f"{header}[:EVENt]", query=bare(lambda: f"{register.read_event():+d}"))
        self.tree.add(f"{header}:CONDition", query=bare(lambda: f"{register.condition():+d}"))
        self.tree.add(f"{header}:ENABle", command=set_enable, query=bare(lambda: f"{register.enable:+d}"))

    def status_byte(self, available: bool | None = None) -> int:
        """Return the status byte with MSS in bit 6; `available` tells of a reply in a client's own output queue."""
        value = MESSAGE_AVAILABLE if (self.message_available if available is None else available) else 0
        self._settle()
        if self._queue_bit and len(self.errors):
            value |= self._queue_bit
        if self._event_status & self._event_enable:
            value |= EVENT_SUMMARY
        for bit, register in self._registers:
            if register.summary():
                value |= bit
        if value & self._service_enable & ~REQUEST:
            value |= REQUEST
        return value

    def service_reasons(self, available: bool) -> int:
        """Return the bits of the status byte for which service is asked; none where nobody wants to be asked."""
        enabled = self._service_enable & ~REQUEST
        return self.status_byte(available) & enabled if enabled else 0

    def bus_trigger(self) -> None:
        """Take a trigger of the bus, as *TRG would be."""
        self.write(b"*TRG\n")

    def clear(self) -> None:
        """Device clear; an *OPC that is awaited is forgotten with the rest."""
        busy = self.busy
        super().clear()
        self.give_up(busy)

    def give_up(self, busy: bool) -> None:
        """Give up what device clear ends besides the messages; `busy` says that one was being handled."""
        self._opc_armed = False

    def _settle(self) -> None:
        if self._opc_armed and self.pending() is None:
            self._opc_armed = False
            self._event_status |= OPERATION_COMPLETE

    def _add_common(self) -> None:
        add = self.tree.add
        add("*IDN", query=bare(lambda: self.identity))
        add("*OPT", query=bare(lambda: self.options()))
        add("*TST", query=bare(lambda: "+0"))
        add("*RST", command=bare(self._reset))
        add("*CLS", command=bare(self._clear_status))
        add("*ESE", command=self._set_event_enable, query=bare(lambda: f"{self._event_enable:+d}"))
        add("*ESR", query=bare(self._read_events))
        add("*SRE", command=self._set_service_enable, query=bare(lambda: f"{self._service_enable & ~REQUEST:+d}"))
        add("*STB", query=bare(lambda: f"{self.status_byte():+d}"))
        add("*OPC", command=bare(self._arm_complete), query=bare(self._when_complete))
        add("*WAI", command=bare(self._wait_complete))
        add("*TRG", command=bare(lambda: self.trigger()))
        if self.power_on_clears:
            add("*PSC", command=self._set_power_on_clear, query=bare(lambda: f"{self._power_on_clear:+d}"))
        add("SYSTem:ERRor[:NEXT]", query=bare(self._next_error))
        add("SYSTem:VERSion", query=bare(lambda: self._version))
        add("STATus:PRESet", command=bare(self._preset))

    def _reset(self) -> None:
        self._opc_armed = False
        self.reset()

    def _clear_status(self) -> None:
        self.errors.clear()
        self._event_status = 0
        self._opc_armed = False
        for _bit, register in self._registers:
            register.clear()

    def _preset(self) -> None:
        for _bit, register in self._registers:
            register.enable = 0

    def _set_event_enable(self, call: Call) -> None:
        exactly(call.arguments, 1)
        self._event_enable = integer(call.arguments[0], 0, 255)

    def _set_service_enable(self, call: Call) -> None:
        exactly(call.arguments, 1)
        self._service_enable = integer(call.arguments[0], 0, 255)

    def _set_power_on_clear(self, call: Call) -> None:
        exactly(call.arguments, 1)
        self._power_on_clear = integer(call.arguments[0], -32767, 32767) != 0

    def _read_events(self) -> str:
        self._settle()
        events, self._event_status = self._event_status, 0
        return f"{events:+d}"

    def _arm_complete(self) -> None:
        self._opc_armed = True
        self._settle()

    def _when_complete(self) -> str | Handling:
        return "1" if self.pending() is None else self._reply_when_complete()

    def _reply_when_complete(self) -> Handling:
        yield from self._until_complete()
        return "1"

    def _wait_complete(self) -> Handling | None:
        return None if self.pending() is None else self._until_complete()

    def _until_complete(self) -> Handling:
        while (wake := self.pending()) is not None:
            yield wake
        return None

    def _next_error(self) -> str:
        error = self.errors.pop()
        return f'{error.number:+d},"{error.text}"'
