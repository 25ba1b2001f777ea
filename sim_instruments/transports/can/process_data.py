"""A node's transmit PDOs (CiA 301, 1800h and 1A00h): what it sends on a SYNC, as a master has mapped it."""

from collections.abc import Callable, Collection

from sim_instruments.instruments.cia402.power import OUT_OF_RANGE, ObjectEntry, SdoError

SYNC = 0x080
_COMMUNICATION, _MAPPING, _COUNT, _ENTRIES = 0x1800, 0x1A00, 2, 4
_NOT_VALID, _LAST_CYCLE = 1 << 31, 240
_BITS = 64
#: A PDO is not changed while it is valid; what cannot be mapped; what does not fit into a frame.
UNSUPPORTED_ACCESS, NOT_MAPPABLE, TOO_LONG = 0x06010000, 0x06040041, 0x06040042


class TransmitPdos:
    """Two transmit PDOs, none of them valid until a master has mapped something into it.

    `mappable` are the objects that may be, `read` gives an object's bytes, `send` a frame. With a transmission type of 1 to 240
    a PDO is sent with every so many SYNCs; one of another type is taken and never sent.
    """

    def __init__(
        self,
        node_id: int,
        mappable: Collection[int],
        read: Callable[[int, int], bytes],
        send: Callable[[int, bytes], None],
    ) -> None:
        self._mappable, self._read, self._send = mappable, read, send
        self._values: dict[tuple[int, int], int] = {}
        for number in range(_COUNT):
            self._values[_COMMUNICATION + number, 1] = _NOT_VALID | 0x180 + 0x100 * number + node_id
            self._values[_COMMUNICATION + number, 2] = 255
            self._values |= {(_MAPPING + number, subindex): 0 for subindex in range(_ENTRIES + 1)}
        self._syncs = [0] * _COUNT

    @property
    def entries(self) -> tuple[ObjectEntry, ...]:
        """The entries that they add to a node's object dictionary."""
        result: list[ObjectEntry] = []
        for number in range(_COUNT):
            index, name = _COMMUNICATION + number, f"TPDO {number + 1} parameter"
            result += (
                ObjectEntry(index, f"{name}: highest subindex", "u8", "const", 0, 2),
                ObjectEntry(index, f"{name}: COB-ID", "u32", "rw", 1, self._values[index, 1]),
                ObjectEntry(index, f"{name}: transmission type", "u8", "rw", 2, 255),
            )
            index, name = _MAPPING + number, f"TPDO {number + 1} mapping"
            result.append(ObjectEntry(index, f"{name}: number of objects", "u8", "rw", 0, 0))
            result += (
                ObjectEntry(index, f"{name}: {entry}", "u32", "rw", entry, 0) for entry in range(1, _ENTRIES + 1)
            )
        return tuple(result)

    def write(self, index: int, subindex: int, value: int) -> bool:
        """Take a written object; return whether it is one of these. Raises SdoError for what may not be."""
        if (index, subindex) not in self._values:
            return False
        number = index & 0xFF
        identifier = self._values[_COMMUNICATION + number, 1]
        if not identifier & _NOT_VALID and (index, subindex) != (_COMMUNICATION + number, 1):
            raise SdoError(UNSUPPORTED_ACCESS, f"object {index:04X}h: the PDO is valid")
        if index >= _MAPPING:
            self._check(number, subindex, value)
        elif subindex == 1 and (value ^ identifier) & 0x7FF:
            raise SdoError(OUT_OF_RANGE, f"object {index:04X}h: the identifier is fixed")
        self._values[index, subindex] = value
        return True

    def synchronise(self) -> None:
        """Send what is due with a SYNC."""
        for number in range(_COUNT):
            identifier, kind = (self._values[_COMMUNICATION + number, subindex] for subindex in (1, 2))
            if identifier & _NOT_VALID or not 1 <= kind <= _LAST_CYCLE:
                continue
            self._syncs[number] += 1
            if self._syncs[number] % kind == 0:
                data = b"".join(self._read(entry >> 16, entry >> 8 & 0xFF) for entry in self._mapped(number))
                self._send(identifier & 0x7FF, data)

    def _mapped(self, number: int) -> list[int]:
        count = self._values[_MAPPING + number, 0]
        return [self._values[_MAPPING + number, entry] for entry in range(1, count + 1)]

    def _check(self, number: int, subindex: int, value: int) -> None:
        if subindex and value and value >> 16 not in self._mappable:
            raise SdoError(NOT_MAPPABLE, f"object {value >> 16:04X}h cannot be mapped")
        if not subindex:
            entries = [self._values[_MAPPING + number, entry] for entry in range(1, min(value, _ENTRIES) + 1)]
            if value > _ENTRIES or sum(entry & 0xFF for entry in entries) > _BITS:
                raise SdoError(TOO_LONG, "more than a frame holds")
