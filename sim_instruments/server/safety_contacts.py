"""Emergency stop and door of a served bench: two contacts, on a Modbus input module and in a cyclic CAN frame."""

import asyncio
import contextlib

import can

from sim_instruments.instruments.registers import ILLEGAL_ADDRESS, RegisterError
from sim_instruments.transports.can.buses import open_bus

#: The contacts in the order of their bits.
CONTACTS = ("emergency_stop", "door")
#: The CAN frame that carries them, and how often (s, of the wall's time) it is sent.
FRAME, CYCLE = 0x1A0, 0.02
_NO_SUCH_FUNCTION = 1


class SafetyContacts:
    """The state of the safety contacts; all are closed at the start."""

    def __init__(self) -> None:
        self._closed = dict.fromkeys(CONTACTS, True)

    def set(self, name: str, closed: bool) -> None:
        """Close or open a contact. Raises KeyError for an unknown one."""
        if name not in self._closed:
            raise KeyError(name)
        self._closed[name] = closed

    def states(self) -> dict[str, bool]:
        """Return of each contact whether it is closed."""
        return dict(self._closed)

    def bits(self) -> list[bool]:
        """Return them in the order of their bits; a closed contact is 1."""
        return [self._closed[name] for name in CONTACTS]


class InputModule:
    """A Modbus unit whose coils and discrete inputs, from 0, are the contacts; it has no registers."""

    ranges: tuple[tuple[int, int], ...] = ()
    readings = (0, 0, 1)
    unit = 1

    def __init__(self, contacts: SafetyContacts) -> None:
        self._contacts = contacts

    def read_bits(self, address: int, count: int) -> list[bool]:
        """Return bits. Raises RegisterError 2 where there are fewer."""
        bits = self._contacts.bits()
        if address + count > len(bits):
            raise RegisterError(ILLEGAL_ADDRESS, f"the module has {len(bits)} inputs, no {address + count - 1}")
        return bits[address : address + count]

    def read(self, address: int, count: int) -> list[int]:
        """Raise RegisterError 1: it has no registers."""
        raise RegisterError(_NO_SUCH_FUNCTION, "an input module has no registers")

    def write(self, address: int, values: list[int]) -> None:
        """Raise RegisterError 1: it has no registers."""
        raise RegisterError(_NO_SUCH_FUNCTION, "an input module has no registers")


class ContactFrames:
    """Sends the contacts as the bits of the first byte of a frame, again and again, until it is closed."""

    def __init__(self, contacts: SafetyContacts, channel: str) -> None:
        self._contacts = contacts
        self._bus = open_bus(channel)
        self._task: asyncio.Task[None] | None = None

    async def start(self) -> None:
        """Begin to send."""
        self._task = asyncio.get_running_loop().create_task(self._send())

    async def stop(self) -> None:
        """Send no more, and leave the bus."""
        if self._task is not None:
            self._task.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await self._task
            self._task = None
            self._bus.shutdown()

    async def _send(self) -> None:
        while True:
            byte = sum(bit << place for place, bit in enumerate(self._contacts.bits()))
            with contextlib.suppress(can.CanError):
                self._bus.send(can.Message(arbitration_id=FRAME, data=[byte], is_extended_id=False))
            await asyncio.sleep(CYCLE)
