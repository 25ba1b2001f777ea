"""A recorded session's instruments in this process, without wires and waits."""

from collections.abc import Mapping
from contextlib import ExitStack
from functools import cached_property
from threading import get_ident

from sim_instruments.bench import direct_address, visa_address
from sim_instruments.catalogue import Transport
from sim_instruments.clock.virtual_clock import VirtualClock
from sim_instruments.recorded.instruments import RecordedNode, RecordedPort, RecordedScpi, RecordedUnits
from sim_instruments.recorded.replies import RecordedReplies, RecordedSession
from sim_instruments.transports.can.in_process import CHANNEL, DirectBus, DirectEnd
from sim_instruments.transports.modbus.in_process import ModbusStream
from sim_instruments.transports.visa.library import InProcessVisaLibrary


class RecordedBench:
    """Recorded instruments by role, reached as those of a virtual bench in process; each answer comes when it did.

    The session is repeated on the thread that makes this.
    """

    def __init__(self, sessions: Mapping[str, RecordedSession], clock: VirtualClock) -> None:
        self._sessions = sessions
        self._clock = clock
        self._caller = get_ident()
        self._open = ExitStack()

    def address(self, role: str) -> str:
        """Return where an instrument is reached."""
        session = self._sessions[role]
        if session.transport == "can":
            return f"can://in-process/{CHANNEL}?node={session.unit}"
        return visa_address(role) if session.transport == "visa" else direct_address(role)

    @cached_property
    def visa_library(self) -> InProcessVisaLibrary:
        """The library to hand to `pyvisa.ResourceManager`."""
        library = InProcessVisaLibrary(
            {
                visa_address(role): RecordedScpi(self._replies(session), self._clock, apart=True)
                for role, session in self._of("visa").items()
            }
        )
        self._open.callback(library.shut)
        return library

    def stream(self, address: str) -> ModbusStream | RecordedPort:
        """Return the byte stream at an address. Raises LookupError where there is none."""
        for role, line in self._lines.items():
            if address == direct_address(role):
                return ModbusStream(line)
        for role, port in self._ports.items():
            if address == direct_address(role):
                return port
        raise LookupError(f"this recording has no {address}")

    def can_bus(self, channel: str) -> DirectEnd:
        """Return an end of the CAN bus that the recorded nodes are on."""
        return self._bus.end()

    def close(self) -> None:
        """Leave PyVISA's registry and the bus; again is allowed."""
        self._open.close()

    @cached_property
    def _lines(self) -> dict[str, RecordedUnits]:
        return {role: RecordedUnits(self._replies(one), self._clock) for role, one in self._of("modbus").items()}

    @cached_property
    def _ports(self) -> dict[str, RecordedPort]:
        return {role: RecordedPort(one, self._clock, self._reach) for role, one in self._of("serial").items()}

    @cached_property
    def _bus(self) -> DirectBus:
        bus = DirectBus(self._clock)
        for session in self._of("can").values():
            end = bus.end()
            self._open.callback(end.shutdown)
            end.hand_over(RecordedNode(self._replies(session), end.send).on_message_received)
        return bus

    def _of(self, transport: Transport) -> dict[str, RecordedSession]:
        return {role: session for role, session in self._sessions.items() if session.transport == transport}

    def _replies(self, session: RecordedSession) -> RecordedReplies:
        return RecordedReplies(session, self._reach, caller=self._caller)

    def _reach(self, time: float) -> None:
        self._clock.sleep(max(0.0, time - self._clock.now()))
