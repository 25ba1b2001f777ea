"""Equality of two messages: to the byte, or up to the numbers in them."""

import re
from collections.abc import Callable

from drivers.transport.wire import Carrier

#: A number in a SCPI message that is no part of a word; a list of channels is none.
_NUMBER = re.compile(rb"(\(@[^)]*\))|(?<![A-Za-z0-9_.])[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")
#: Modbus functions that write, and how much of a request says what is written, not which value (unit, function, address, count).
_WRITTEN = {5: 4, 6: 4, 15: 6, 16: 6}
#: An SDO request that carries data: the command, and for the first one object and subindex.
_DOWNLOAD = re.compile(rb"(6[0-9A-F]{2}#)(?:(2[0-9A-F]{7})|([01][0-9A-F]))[0-9A-F]*")


def message_of(carrier: Carrier, data: bytes) -> bytes:
    """Return what a transmission says without what only frames it: Modbus as unit and PDU, text without its end.

    Of several Modbus TCP frames the last one counts, the others having come late. Empty for a Modbus frame that is none.
    """
    if carrier == "modbus tcp":
        while len(data) > (end := 6 + int.from_bytes(data[4:6])) > 6:
            data = data[end:]
        return data[6:] if len(data) > 7 else b""
    if carrier == "modbus rtu":
        return data[:-2] if len(data) > 3 else b""
    if carrier == "modbus ascii":
        try:
            return bytes.fromhex(data.strip(b":\r\n").decode("ascii"))[:-1]
        except ValueError:
            return b""
    return data.rstrip(b"\r\n") if carrier == "visa" else data


def key_for(carrier: Carrier, *, tolerant: bool) -> Callable[[bytes], bytes]:
    """Return what two messages of a carrier have in common where they are the same; `tolerant` of numbers."""
    if not tolerant:
        return lambda message: message
    if carrier == "visa":
        return lambda message: _NUMBER.sub(lambda match: match[1] or b"#", message)
    if carrier == "can":
        return lambda message: _DOWNLOAD.sub(rb"\1\2\3", message)
    if carrier.startswith("modbus"):
        return lambda message: message[: _WRITTEN.get(message[1], len(message))] if len(message) > 1 else message
    return lambda message: message
