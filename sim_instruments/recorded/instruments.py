"""Recorded instruments as each transport has them."""

from collections import deque
from collections.abc import Callable, Mapping
from typing import Any

import can
import numpy as np

from sim_instruments.faults.line_faults import Fault
from sim_instruments.recorded.replies import RecordedReplies, RecordedSession
from sim_instruments.scpi.errors import ScpiError
from sim_instruments.scpi.exchange import InstrumentClock, ReadEnd
from sim_instruments.scpi.instrument import ScpiInstrument
from sim_instruments.scpi.tree import Call, HalfReply, Handler, WholeReply
from sim_instruments.transports.modbus.unit import ModbusLine

_UNDEFINED_HEADER = -113
_ERROR_QUERIES = ("SYST:ERR?", "SYSTEM:ERROR?", "SYST:ERR:NEXT?", "SYSTEM:ERROR:NEXT?")
_ILLEGAL_FUNCTION = 1


class RecordedScpi(ScpiInstrument):
    """Answers recorded messages; common commands that were not recorded do what the standard says, all else is error -113.

    `apart` says that each reply is a message of its own even where several had come late.
    """

    def __init__(self, replies: RecordedReplies, clock: InstrumentClock, *, apart: bool = False) -> None:
        super().__init__(clock, np.random.default_rng(0), "recorded")
        self._replies = replies
        self._apart = apart
        self._further: deque[bytes] = deque()
        self._broken = ""
        self.tree.whole = self._recorded

    def reset(self) -> None:
        """Do nothing: there are no settings."""

    def report(self, error: ScpiError) -> None:
        """Queue that a message is unknown; what else the recorded instrument reported is in the recording."""
        if error.number == _UNDEFINED_HEADER:
            super().report(error)

    def write(self, data: bytes, end: bool = True) -> None:
        """Take bytes of a message. Raises ConnectionResetError where the connection failed then."""
        self._broken = ""
        super().write(data, end)
        if self._broken == "write":
            raise ConnectionResetError("the connection failed here")

    def read(self, count: int, timeout: float | None, termination: int | None = None) -> tuple[bytes, ReadEnd]:
        """Return bytes of the next reply. Raises ConnectionResetError where the connection failed then."""
        if self._broken and self._output is None and not self._further:
            raise ConnectionResetError("the connection failed here")
        if self._output is None and self._further:
            self._output = self._further.popleft()
        return super().read(count, timeout, termination)

    def clear(self) -> None:
        """Device clear."""
        super().clear()
        self._further.clear()

    def _recorded(self, message: str) -> Handler | None:
        text = message.rstrip("\r").encode("latin-1")
        asks = message.strip().lstrip(":").upper() in _ERROR_QUERIES
        if not self._replies.knows(text) and not asks:
            return None

        def handle(_: Call) -> WholeReply | str | None:
            if asks and (len(self.errors) or not self._replies.knows(text)):
                return self._next_error()
            exchange = self._replies.answer(text)
            replies, self._broken = exchange.replies, exchange.broken
            if self._apart:
                self._further.extend(replies[1:])
                replies = replies[:1]
            return (WholeReply if exchange.whole else HalfReply)(b"".join(replies)) if replies else None

        return handle


class RecordedUnits(ModbusLine):
    """A Modbus line whose units answer recorded requests, and others by exception 1 (illegal function)."""

    def __init__(self, replies: RecordedReplies, clock: InstrumentClock) -> None:
        self._known: dict[int, Any] = dict.fromkeys(message[0] for message in replies.messages if message)
        super().__init__((), clock, np.random.default_rng(0))
        self._replies = replies

    @property
    def units(self) -> Mapping[int, Any]:
        """The numbers that were asked."""
        return self._known

    def recorded(self, unit: int, request: bytes) -> tuple[bytes, Fault | None]:
        """Return the response to a request, empty where none came."""
        message = bytes([unit]) + request
        if not self._replies.knows(message):
            return bytes([request[0] | 0x80, _ILLEGAL_FUNCTION]), None
        return b"".join(reply[1:] for reply in self._replies.answer(message).replies), None


class RecordedPort:
    """A serial line that gives what came, read by read, then the last of it again and again; a byte stream in process."""

    def __init__(self, session: RecordedSession, clock: InstrumentClock, reach: Callable[[float], None]) -> None:
        self._clock = clock
        self._reach = reach
        self._coming = deque(
            (exchange.time, reply)
            for exchange in session.exchanges
            for reply in exchange.replies
            if not exchange.message
        )
        self._replies = RecordedReplies(session, reach)
        self._begun = b""

    def write(self, data: bytes) -> int:
        """Take a message, which is answered where it is known."""
        if self._replies.knows(data):
            self._coming.extendleft((0.0, reply) for reply in reversed(self._replies.answer(data).replies))
        return len(data)

    def read(self, count: int, timeout: float) -> bytes:
        """Return up to `count` bytes, nothing once `timeout` (s, bench) has passed where nothing came."""
        if not self._begun and self._coming:
            time, self._begun = self._coming[0]
            if len(self._coming) > 1:
                self._coming.popleft()
            self._reach(time)
        if not self._begun:
            self._clock.sleep(timeout)
        data, self._begun = self._begun[:count], self._begun[count:]
        return data

    def reset_input_buffer(self) -> None:
        """Throw away what was begun; what was recorded had come after."""
        self._begun = b""

    def close(self) -> None:
        """Hold nothing; again is allowed."""


class RecordedNode(can.Listener):
    """A CAN node that answers recorded frames by `send`, and others not at all."""

    def __init__(self, replies: RecordedReplies, send: Callable[[can.Message], None]) -> None:
        self._replies, self._send = replies, send

    def on_message_received(self, msg: can.Message) -> None:
        """Answer a frame."""
        data = "R" if msg.is_remote_frame else msg.data.hex().upper()
        identifier = f"{msg.arbitration_id:0{8 if msg.is_extended_id else 3}X}"
        frame = f"{identifier}{f'##{int(msg.bitrate_switch)}' if msg.is_fd else '#'}{data}".encode()
        if self._replies.knows(frame):
            for reply in self._replies.answer(frame).replies:
                self._send(_frame_of(reply.decode()))


def _frame_of(reply: str) -> can.Message:
    """Return the frame that candump writes so; of CAN FD its flags stand before the data."""
    identifier, _, content = reply.partition("#")
    fd = content.startswith("#")
    return can.Message(
        arbitration_id=int(identifier, 16),
        is_extended_id=len(identifier) > 3,
        is_fd=fd,
        bitrate_switch=fd and content[1] == "1",
        data=bytes.fromhex(content[2:] if fd else content),
    )
