"""What simulated instruments need of a recording to answer as it does."""

from collections.abc import Iterator
from typing import cast

from bench.traffic.messages import key_for, message_of
from bench.traffic.traffic_file import Recording
from drivers.interfaces import Role
from drivers.transport.can.addresses import parse_address
from drivers.transport.wire import Carrier
from sim_instruments.catalogue import Transport
from sim_instruments.recorded.replies import Exchange, RecordedSession


def session_of(recording: Recording, role: Role, *, tolerant: bool) -> RecordedSession:
    """Return the exchanges with one instrument; `tolerant` of numbers in what it is sent."""
    carrier = recording.carriers[role]
    transport = cast("Transport", carrier.partition(" ")[0])
    node = parse_address(str(recording.tables[role.value]["address"]), role.value)[1] if carrier == "can" else 0
    key = key_for(carrier, tolerant=tolerant)
    exchanges = list(_exchanges(recording, role, carrier))
    # What was sent beside the calls took no answer away from them.
    told = [exchange for exchange, beside in exchanges if not beside] + [one for one, beside in exchanges if beside]
    return RecordedSession(transport, told, key, node)


def _exchanges(recording: Recording, role: Role, carrier: Carrier) -> Iterator[tuple[Exchange, bool]]:
    """Give each exchange, and whether it was beside the calls."""
    time, message, replies, kind = 0.0, b"", list[bytes](), ">"
    for line in (*recording.of(role), None):
        if line is None or line.kind in ">~":
            yield from ((exchange, kind == "~") for exchange in _exchange(carrier, time, message, replies))
        if line is None:
            return
        if line.kind in ">~":
            time, message, replies, kind = line.time, message_of(carrier, line.content), [], line.kind
        elif line.kind == "<":
            time = line.time
            replies.append(line.content)
        elif line.kind == "!" and carrier == "serial":
            replies.append(b"")


def _exchange(carrier: Carrier, time: float, message: bytes, replies: list[bytes]) -> Iterator[Exchange]:
    if carrier.startswith("modbus"):
        # A frame may have come in pieces.
        replies = [whole] if (whole := message_of(carrier, b"".join(replies))) else []
    if message:
        yield Exchange(time, message, tuple(replies))
    elif carrier == "serial":
        yield from (Exchange(time, b"", (reply,)) for reply in replies)
