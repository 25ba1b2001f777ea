"""One moteus on a bus: questions by frames, each with a source of its own so that a late reply is never taken for another's."""

import math
from collections.abc import Collection, Mapping
from itertools import cycle
from time import monotonic

from drivers.interfaces import UNWATCHED, Calls, CommunicationError, Identity, ReportedError, Traffic
from drivers.interfaces.text import text
from drivers.mjbots.identity import IDENTITY_QUESTION, IDENTITY_REGISTERS, identity_of
from drivers.mjbots.multiplex import NOP, MultiplexReply, parse, reply_identifier, request_identifier
from drivers.mjbots.registers import MAP_VERSIONS, Register
from drivers.transport.can.fd_frames import FrameLine, padded

#: A moteus answers within a millisecond; an adapter on USB may need some. Three times that is less than it may be silent.
_REPLY_TIME = 0.15
_ATTEMPTS = 3
#: Sources of the questions of a run, and of whoever holds a connection for the shutdown; 0 is that of the maker's tools.
_SOURCES, _GUARDING_SOURCES = range(0x10, 0x20), range(0x20, 0x30)


class MoteusController:
    """A controller by its line; `prefix` is its `can.prefix`. `name` stands for it in messages."""

    def __init__(
        self,
        line: FrameLine,
        name: str,
        *,
        prefix: int = 0,
        traffic: Traffic | None = None,
        calls: Calls = UNWATCHED,
        guarding: bool = False,
    ) -> None:
        self.name = name
        self.calls = calls
        self._line = line
        self._prefix = prefix
        self._traffic = traffic
        sources = _GUARDING_SOURCES if guarding else _SOURCES
        self._sources = cycle(sources)
        first = reply_identifier(prefix, sources.start, line.node_id)
        line.listen(range(first, first + len(sources)))

    def identify(self) -> Identity:
        """Return who it is. Raises ReportedError for firmware whose registers mean something else; other errors as for `ask`."""
        values = self.ask(IDENTITY_QUESTION, "read 0x101, 0x102, 0x120", (Register.MAP_VERSION,), IDENTITY_REGISTERS)
        version = round(values[Register.MAP_VERSION])
        if version not in MAP_VERSIONS:
            raise ReportedError(
                self.name,
                text(
                    "its register map has version {version}, known are {known}",
                    version=version,
                    known=[str(one) for one in MAP_VERSIONS],
                ),
                command="read 0x102",
                remedy=text("Update its firmware with moteus_tool --flash"),
            )
        return identity_of(values)

    def ask(
        self, payload: bytes, command: str, needed: Collection[int], absent: Collection[int] = ()
    ) -> Mapping[int, float]:
        """Return the registers of the reply to a frame that may be sent again where no reply comes.

        `needed` are those that must be in it; those of `absent` besides may be NaN. Raises CommunicationError for no usable
        reply, ReportedError where a register is refused.
        """
        values = self.exchange(payload, command, attempts=_ATTEMPTS).values
        for register in (*needed, *absent):
            if register not in values or (register in needed and not math.isfinite(values[register])):
                raise CommunicationError(
                    self.name,
                    text("register {register} has no number in its reply", register=f"0x{register:03X}"),
                    command=command,
                )
        return values

    def exchange(self, payload: bytes, command: str, *, attempts: int = 1) -> MultiplexReply:
        """Return the reply to a frame; errors as for `ask`."""
        with self.calls.exchange():
            for _ in range(attempts):
                data = self._replied(payload)
                if data is not None:
                    break
            else:
                raise CommunicationError(
                    self.name,
                    text("no reply"),
                    command=command,
                    remedy=text("Check node, can_prefix, bit rates, the bus' resistors and the drive's supply"),
                )
        try:
            reply = parse(data)
        except ValueError as error:
            raise CommunicationError(
                self.name, text("no usable reply ({error})", error=error), command=command
            ) from error
        if reply.refused:
            raise ReportedError(
                self.name,
                text("it does not accept register {registers}", registers=reply.refused),
                command=command,
                remedy=text("Update its firmware, or take another drive"),
            )
        return reply

    def reopen(self) -> None:
        """Connect to the bus anew; raises CommunicationError where that fails."""
        self._line.reopen()

    def disconnect(self) -> None:
        """Leave the bus; may be called twice."""
        self._line.disconnect()

    def _replied(self, payload: bytes) -> bytes | None:
        source, node = next(self._sources), self._line.node_id
        self._line.discard()
        self._tell("write", payload)
        self._line.send(request_identifier(self._prefix, source, node), padded(payload, NOP))
        wanted, end = reply_identifier(self._prefix, source, node), monotonic() + _REPLY_TIME
        while (heard := self._line.receive(max(0.0, end - monotonic()))) is not None:
            if heard[0] == wanted:
                self._tell("read", heard[1])
                return heard[1]
        return None

    def _tell(self, direction: str, data: bytes) -> None:
        if self._traffic is not None:
            self._traffic(direction, data.hex(" "))
