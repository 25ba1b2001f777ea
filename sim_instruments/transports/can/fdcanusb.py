"""CAN FD frames as lines of text, as mjbots' fdcanusb and the UART of a moteus have them.

Sources: the README of mjbots/fdcanusb; checksums from `fw/uart_fdcanusb_micro_server.h` of mjbots/moteus. Its `conf` is not there.
"""

import re
from dataclasses import dataclass

import can

END = b"\r\n"
#: The longest line that is taken, as the UART's.
_LONGEST = 254
_STANDARD, _LARGEST = 0x7FF, 0x1FFFFFFF
_SIZES = (0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64)
_PADDING = b"\x50"
_POLYNOMIAL = 0x97
_COMMAND = re.compile(r"can (send|std|ext) ([0-9a-fA-F]+) ((?:[0-9a-fA-F]{2})*)((?: *[BbFfRr])*) *")


@dataclass(frozen=True)
class FdcanusbReply:
    """The result of a line: the reply to its sender, and a frame for the bus."""

    reply: bytes
    frame: can.Message | None = None


class FdcanusbAdapter:
    """One adapter, on the bus from the beginning. Once a line has come with a right checksum, every line has one, either way."""

    def __init__(self) -> None:
        self._rest = b""
        self._checked = False

    def feed(self, data: bytes) -> list[FdcanusbReply]:
        """Return what the lines lead to that are complete with `data`; one that is too long is dropped."""
        *whole, self._rest = (self._rest + data).replace(b"\r", b"\n").split(b"\n")
        if len(self._rest) > _LONGEST:
            self._rest = b""
        return [self._take(line) for line in whole if line]

    def line_of(self, frame: can.Message) -> bytes:
        """Return the line that tells of a frame on the bus."""
        flags = (
            "E" if frame.is_extended_id else "e",
            "B" if frame.bitrate_switch else "b",
            "F" if frame.is_fd else "f",
        )
        return self._sent(f"rcv {frame.arbitration_id:x} {frame.data.hex()} {' '.join(flags)}")

    def _take(self, line: bytes) -> FdcanusbReply:
        if re.fullmatch(rb".*\*[0-9a-fA-F]{2}", line):
            if checksum(line[:-3]) != int(line[-2:], 16):
                return FdcanusbReply(self._sent("ERR checksum"))
            self._checked, line = True, line[:-3].rstrip(b" ")
        elif self._checked:
            return FdcanusbReply(self._sent("ERR checksum"))
        text = line.decode("ascii", "replace")
        if text in ("can on", "can off"):
            return FdcanusbReply(self._sent("OK"))
        if text == "can status":
            return FdcanusbReply(self._sent("mode:BUSON") + self._sent("OK"))
        match = _COMMAND.fullmatch(text)
        if match is None:
            return FdcanusbReply(self._sent("ERR unknown command"))
        frame = _frame(match)
        if frame is None:
            return FdcanusbReply(self._sent("ERR invalid frame"))
        return FdcanusbReply(self._sent("OK"), frame)

    def _sent(self, text: str) -> bytes:
        line = text.encode()
        if self._checked:
            line += b" "
            line += f"*{checksum(line):02X}".encode()
        return line + END


def _frame(match: re.Match[str]) -> can.Message | None:
    kind, identifier, data, flags = (
        match.group(1),
        int(match.group(2), 16),
        bytes.fromhex(match.group(3)),
        match.group(4),
    )
    size = next((size for size in _SIZES if len(data) <= size), None)
    if size is None or identifier > (_STANDARD if kind == "std" else _LARGEST):
        return None
    extended = kind == "ext" or identifier > _STANDARD
    if "R" in flags:
        return can.Message(arbitration_id=identifier, is_extended_id=extended, is_remote_frame=True, dlc=min(size, 8))
    # The newer adapter sends CAN FD unless it is told otherwise.
    fd = "f" not in flags or size > 8
    return can.Message(
        arbitration_id=identifier,
        is_extended_id=extended,
        is_fd=fd,
        bitrate_switch=fd and "b" not in flags,
        data=data.ljust(size, _PADDING),
    )


def checksum(data: bytes) -> int:
    """Return the CRC-8 of a line's bytes, polynomial 97h."""
    register = 0
    for byte in data:
        register ^= byte
        for _ in range(8):
            register = (register << 1 ^ _POLYNOMIAL if register & 0x80 else register << 1) & 0xFF
    return register
