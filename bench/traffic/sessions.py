"""Settings with which simulated instruments answer as a recording does."""

import re
from collections.abc import Iterator, Sequence
from typing import Literal, cast

from bench.i18n.errors import FileError, at
from bench.traffic.messages import key_for, message_of
from bench.traffic.traffic_file import SessionRecording, TrafficLine, broken
from drivers.interfaces import CommunicationError, Role
from drivers.interfaces.text import text, text_of
from drivers.transport.can.addresses import parse_address
from drivers.transport.wire import Carrier
from sim_instruments.catalogue import Transport
from sim_instruments.recorded.replies import Exchange, RecordedSession

#: A CAN frame as candump writes it; one of CAN FD has a digit of flags, and 29 bits of identifier where it needs them.
_FRAME = re.compile(
    rb"[0-7][0-9A-F]{2}#(?:R|(?:[0-9A-F]{2}){0,8})"
    rb"|(?:[0-7][0-9A-F]{2}|[01][0-9A-F]{7})##[0-9A-F](?:[0-9A-F]{2}){0,64}"
)


def session_of(recording: SessionRecording, role: Role, *, tolerant: bool) -> RecordedSession:
    """Return the exchanges with one instrument; `tolerant` of numbers in what it is sent."""
    carrier = recording.carriers[role]
    transport = cast("Transport", carrier.partition(" ")[0])
    try:
        node = parse_address(str(recording.tables[role.value]["address"]), role.value)[1] if carrier == "can" else 0
    except CommunicationError as error:
        raise FileError(at(recording.source, text_of(error))) from None
    key = key_for(carrier, tolerant=tolerant)
    exchanges = list(_exchanges(recording, role, carrier))
    # What was sent beside the calls took no answer away from them.
    result = [exchange for exchange, beside in exchanges if not beside] + [one for one, beside in exchanges if beside]
    return RecordedSession(transport, result, key, node)


def _exchanges(recording: SessionRecording, role: Role, carrier: Carrier) -> Iterator[tuple[Exchange, bool]]:
    """Give each exchange, and whether it was beside the calls."""
    opened = TrafficLine(0.0, role, ">", b"")
    lines: list[TrafficLine] = []
    for line in (opened, *recording.of(role), opened):
        if line.kind in ">~" and lines:
            yield from ((exchange, lines[0].kind == "~") for exchange in _exchange(carrier, lines))
            lines = []
        if line.kind in "><~!":
            lines.append(line)
        if carrier == "can" and line.number and line.kind in "><~" and not _FRAME.fullmatch(line.content):
            raise broken(
                recording.source, line.number, text("no line of a recording: {row}", row=repr(line.words[:60]))
            )


def _exchange(carrier: Carrier, lines: Sequence[TrafficLine]) -> Iterator[Exchange]:
    """Give what a message and the lines after it are; from a serial line, each that came unasked."""
    message = message_of(carrier, lines[0].content)
    came = [line for line in lines if line.kind == "<"]
    replies = [line.content for line in came]
    if carrier.startswith("modbus"):
        # A frame may have come in pieces.
        replies = [whole] if (whole := message_of(carrier, b"".join(replies))) else []
    if message:
        time = came[-1].time if came else lines[0].time
        ended = not came or lines[-1] is came[-1]
        yield Exchange(time, message, tuple(replies), ended, _broken(lines[-1]) if carrier == "visa" else "")
    elif carrier == "serial":
        yield from (Exchange(line.time, b"", (line.content if line.kind == "<" else b"",)) for line in lines[1:])


def _broken(last: TrafficLine) -> Literal["", "write", "read"]:
    """Return in what a VISA connection failed; a time-out is none."""
    if last.kind != "!" or last.content.endswith(b"VI_ERROR_TMO"):
        return ""
    return "write" if last.content.startswith(b"write") else "read"
