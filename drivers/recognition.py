"""Recognition of an instrument by what it says of itself, declared on its driver; importing this imports no transport library.

Each kind asks only what changes nothing: `*IDN?`, Modbus function 3, an SDO upload, a read of registers by CAN FD, or listening.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from drivers.interfaces import Identity
from drivers.interfaces.text import Text

#: What a unit answered: registers by their first address; what it refused is not in it.
Registers = Mapping[int, tuple[int, ...]]


@dataclass(frozen=True)
class ScpiIdentity:
    """The answer to `*IDN?` by which an instrument is recognised: `makers` in lower case, and the beginning of the model field,
    in upper case.

    An instrument that does not name its maker answers three fields; `unnamed` is then the maker, and `makers` is empty.
    """

    makers: tuple[str, ...]
    models: tuple[str, ...]
    unnamed: str = ""

    def identity_of(self, line: str) -> Identity | None:
        """Return the identity in a reply, None where another instrument answers."""
        if self.unnamed:
            # Some firmware ends with a comma.
            fields = [self.unnamed, *(field.strip() for field in line.rstrip(", ").split(","))]
        else:
            fields = [field.strip() for field in line.split(",")]
        if len(fields) != 4 or not fields[1].upper().startswith(self.models):
            return None
        return Identity(*fields) if self.unnamed or fields[0].lower() in self.makers else None


@dataclass(frozen=True)
class ModbusUnit:
    """One unit that a driver's instrument is made of: `option` is the driver's option with its number, `name` what it is.

    `reads` are blocks of holding registers (first, count) whose values `recognise` judges; it says what the unit is, or nothing.
    `framings` are those of makers' manuals and of users' programs, as an address has them.
    """

    name: str
    option: str
    reads: tuple[tuple[int, int], ...]
    recognise: Callable[[Registers], Text | None]
    framings: tuple[str, ...] = ()


@dataclass(frozen=True)
class CanOpenProfile:
    """A CANopen node of a device profile: the low half of object 0x1000 (CiA 301)."""

    profile: int

    def matches(self, device_type: int) -> bool:
        """Say whether a device type is of this profile."""
        return device_type & 0xFFFF == self.profile


@dataclass(frozen=True)
class SerialTalk:
    """The traffic of a serial line at `baudrate` (bit/s, 8N1) by which an instrument is recognised: what it sends by itself, or
    in reply to `question`.

    `recognise` gives what the instrument is from the bytes of `wait` (s), or nothing. A question must be one that changes nothing; it is
    sent only on a line that a person named.
    """

    baudrate: int
    recognise: Callable[[bytes], Text | None]
    question: bytes = b""
    wait: float = 1.0


@dataclass(frozen=True)
class CanFdTalk:
    """Nodes that answer a frame of CAN FD which is sent to all of them: `question` by the identifier `request`, at `bitrate` (bit/s).

    `replies` are the identifiers of the answers of nodes 1, 2, 3 …; `identity_of` gives who answers so, or nothing. The question must be
    one that changes nothing.
    """

    bitrate: int
    request: int
    question: bytes
    replies: range
    identity_of: Callable[[bytes], Identity | None]


#: Any of them.
Recognition = ScpiIdentity | ModbusUnit | CanOpenProfile | SerialTalk | CanFdTalk
