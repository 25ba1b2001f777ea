"""A moteus's identity, and a check that its registers are the known ones."""

from base64 import b64encode
from collections.abc import Mapping

from drivers.interfaces import Identity
from drivers.mjbots.multiplex import BROADCAST, INT32, parse, read, reply_identifier, request_identifier
from drivers.mjbots.registers import MAP_VERSIONS, Register
from drivers.recognition import CanFdTalk

#: Rate of the slow phase (bit/s) of its bus; the fast phase has five times that.
BITRATE = 1_000_000
_WORDS = 3
_SERIAL_NUMBER = tuple(Register.SERIAL_NUMBER + place for place in range(_WORDS))
#: Every register that tells who it is.
IDENTITY_REGISTERS = (Register.MAP_VERSION, Register.FIRMWARE_VERSION, *_SERIAL_NUMBER)
IDENTITY_QUESTION = read(Register.FIRMWARE_VERSION, 2, INT32) + read(Register.SERIAL_NUMBER, _WORDS, INT32)
#: The source of a scan's question: none of a run's, nor of the maker's tools.
_SOURCE, _NODES = 0x30, BROADCAST - 1


def identity_of(values: Mapping[int, float]) -> Identity:
    """Return maker, model, serial number (as moteus_tool --info has it) and firmware, of `IDENTITY_REGISTERS`."""
    version = _word(values[Register.FIRMWARE_VERSION])
    number = b"".join(_word(values[register]).to_bytes(4, "big") for register in _SERIAL_NUMBER)
    return Identity(
        "mjbots",
        "moteus",
        b64encode(number).decode("ascii"),
        ".".join(str(version >> shift & 0xFF) for shift in (16, 8, 0)),
    )


def _recognised(data: bytes) -> Identity | None:
    try:
        values = parse(data).values
    except ValueError:
        return None
    known = values.keys() >= set(IDENTITY_REGISTERS) and values[Register.MAP_VERSION] in MAP_VERSIONS
    return identity_of(values) if known else None


def _word(value: float) -> int:
    """Return the 32 bits of a signed number; the most negative one, which stands for no number elsewhere, is one here."""
    return int(value) & 0xFFFFFFFF if value == value else 1 << 31


#: Every node's answer to the question for its identity.
RECOGNITION = CanFdTalk(
    BITRATE,
    request_identifier(0, _SOURCE, BROADCAST),
    IDENTITY_QUESTION,
    range(reply_identifier(0, _SOURCE, 1), reply_identifier(0, _SOURCE, _NODES) + 1, 1 << 8),
    _recognised,
)
