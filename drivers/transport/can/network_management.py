"""A CANopen node's own messages (CiA 301): its NMT state and its emergency frames."""

from dataclasses import dataclass
from enum import IntEnum


class NmtState(IntEnum):
    """States of a node, as heartbeat and node guarding tell them."""

    BOOTING = 0
    STOPPED = 4
    OPERATIONAL = 5
    PRE_OPERATIONAL = 127

    @property
    def words(self) -> str:
        """The state's name as CiA 301 writes it."""
        return self.name.lower().replace("_", "-")


#: The NMT commands that lead to a state.
NMT_COMMANDS = {NmtState.OPERATIONAL: 0x01, NmtState.STOPPED: 0x02, NmtState.PRE_OPERATIONAL: 0x80}

#: Bits of the error register.
_REGISTER = (
    "generic",
    "current",
    "voltage",
    "temperature",
    "communication",
    "device profile",
    "reserved",
    "manufacturer",
)


@dataclass(frozen=True)
class Emergency:
    """One emergency frame: error `code`, error `register` (1001h), and the maker's own five bytes."""

    code: int
    register: int
    data: bytes

    @property
    def kinds(self) -> str:
        """Content of the error register, in words."""
        return ", ".join(name for bit, name in enumerate(_REGISTER) if self.register >> bit & 1) or "none"
