"""CAN frames as lines of text, as LAWICEL's adapters and python-can's `slcan` interface have them."""

import re
from dataclasses import dataclass

import can

END, REFUSED = b"\r", b"\a"
#: The longest line: an extended frame of 64 bytes; more is no command.
LONGEST = 1 + 8 + 1 + 128
_VERSION, _SERIAL_NUMBER, _FLAGS = b"V1013\r", b"NVB01\r", b"F00\r"
_FRAME = re.compile(r"(?:([tr])([0-9A-F]{3})|([TR])([0-9A-F]{8}))([0-8])((?:[0-9A-F]{2})*)", re.IGNORECASE)
#: CAN FD, as CANable's firmware and python-can have it: `d` and `D` at one bit rate, `b` and `B` with another one for the data.
_FD_FRAME = re.compile(r"(?:([db])([0-9A-Fa-f]{3})|([DB])([0-9A-Fa-f]{8}))([0-9A-Fa-f])((?:[0-9A-Fa-f]{2})*)")
_FD_SIZES = (0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64)
# Bit rates by their number or by registers, acceptance code and mask, time stamps off.
_SETTING = re.compile(r"S[0-9]|Y[0-9A-F]|s[0-9A-F]{4}|[Mm][0-9A-F]{8}|Z0|X[01]", re.IGNORECASE)


class LineSplitter:
    """Cuts what comes from a client into lines; one that is too long is dropped up to its end."""

    def __init__(self) -> None:
        self._rest = b""
        self._dropping = False

    @property
    def begun(self) -> bool:
        """True if a part of a line has arrived."""
        return bool(self._rest) or self._dropping

    def feed(self, data: bytes) -> list[bytes | None]:
        """Return the lines that are complete with `data`, None for one that was too long."""
        *ends, self._rest = (self._rest + data).split(END)
        lines: list[bytes | None] = []
        for line in ends:
            lines.append(None if self._dropping or len(line) > LONGEST else line)
            self._dropping = False
        if len(self._rest) > LONGEST:
            self._rest, self._dropping = b"", True
        return lines


@dataclass(frozen=True)
class SlcanReply:
    """The result of a line: a reply to its sender, and a frame for the bus."""

    reply: bytes
    frame: can.Message | None = None


class Adapter:
    """One client's adapter: closed at first, it receives and sends nothing until it is opened (`O`, `L` to listen only).

    Any bit rate is taken, as the bus has none.
    """

    def __init__(self) -> None:
        self.open = False
        self._listens_only = False

    def take(self, line: bytes | None) -> SlcanReply:
        """Return the answer to a line without its end, None being one that was too long."""
        text = "?" if line is None else line.decode("ascii", "replace")
        match text:
            case "":
                return SlcanReply(b"")
            case "O" | "L" if not self.open:
                self.open, self._listens_only = True, text == "L"
                return SlcanReply(END)
            case "C" if self.open:
                self.open = False
                return SlcanReply(END)
            case "V":
                return SlcanReply(_VERSION)
            case "N":
                return SlcanReply(_SERIAL_NUMBER)
            case "F" if self.open:
                return SlcanReply(_FLAGS)
        if not self.open:
            return SlcanReply(END if _SETTING.fullmatch(text) else REFUSED)
        frame = None if self._listens_only else frame_of(text)
        return SlcanReply(REFUSED) if frame is None else SlcanReply(END, frame)


def frame_of(text: str) -> can.Message | None:
    """Return the frame that a line is, None where it is none."""
    match = _FRAME.fullmatch(text)
    if match is None:
        return _fd_frame_of(text)
    short, short_identifier, long, long_identifier, length, data = match.groups()
    remote = (short or long) in ("r", "R")
    identifier = int(short_identifier or long_identifier, 16)
    if identifier > (0x7FF if short else 0x1FFFFFFF) or len(data) != (0 if remote else 2 * int(length)):
        return None
    return can.Message(
        arbitration_id=identifier,
        is_extended_id=short is None,
        is_remote_frame=remote,
        dlc=int(length),
        data=None if remote else bytes.fromhex(data),
    )


def _fd_frame_of(text: str) -> can.Message | None:
    match = _FD_FRAME.fullmatch(text)
    if match is None:
        return None
    short, short_identifier, long, long_identifier, code, data = match.groups()
    identifier, size = int(short_identifier or long_identifier, 16), _FD_SIZES[int(code, 16)]
    if identifier > (0x7FF if short else 0x1FFFFFFF) or len(data) != 2 * size:
        return None
    return can.Message(
        arbitration_id=identifier,
        is_extended_id=short is None,
        is_fd=True,
        bitrate_switch=(short or long) in ("b", "B"),
        dlc=size,
        data=bytes.fromhex(data),
    )


def line_of(frame: can.Message) -> bytes:
    """Return a frame's line with its end."""
    if frame.is_fd:
        kind = "b" if frame.bitrate_switch else "d"
        place = (
            f"{kind.upper()}{frame.arbitration_id:08X}" if frame.is_extended_id else f"{kind}{frame.arbitration_id:03X}"
        )
        return f"{place}{_FD_SIZES.index(frame.dlc):X}{frame.data.hex().upper()}".encode() + END
    kind = "r" if frame.is_remote_frame else "t"
    identifier = (
        f"{kind.upper()}{frame.arbitration_id:08X}" if frame.is_extended_id else f"{kind}{frame.arbitration_id:03X}"
    )
    data = "" if frame.is_remote_frame else frame.data.hex().upper()
    return f"{identifier}{frame.dlc:d}{data}".encode() + END
