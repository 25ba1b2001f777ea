"""Mistakes of a faulty SCPI instrument in a message or a reply: another channel's, or no reading at all."""

import math
import re
import struct

from sim_instruments.faults.line_faults import FaultKind

_CHANNEL = re.compile(r"(\(@\s*|\bCH(?:AN(?:nel)?)?)([1-9])\b", re.IGNORECASE)
#: A reading has a point or an exponent; counts, flags and codes have not.
_READING = re.compile(rb"[-+]?\d+(?:\.\d*(?:[eE][-+]?\d+)?|[eE][-+]?\d+)")
_BLOCK = re.compile(rb"#([1-9])")
_TEXTS = {FaultKind.NOT_A_NUMBER: b"NAN", FaultKind.OVERFLOW: b"+9.90000000E+37"}
_VALUES = {FaultKind.NOT_A_NUMBER: math.nan, FaultKind.OVERFLOW: 9.9e37}
#: In a block of samples, 0 is a hole and all ones is above the screen.
_SAMPLES = {FaultKind.NOT_A_NUMBER: b"\x00", FaultKind.OVERFLOW: b"\xff"}


def other_channel(message: str, channels: int) -> str:
    """Return the message with the channel after each one that it names, the first one after the last."""
    return _CHANNEL.sub(lambda match: f"{match[1]}{int(match[2]) % channels + 1}", message)


def unreadable(reply: bytes, kind: FaultKind) -> bytes:
    """Return the reply with no number, or 9.9E37, in the place of each reading; a block keeps its length."""
    if not reply.startswith(b"#"):
        return _READING.sub(_TEXTS[kind], reply)
    match = _BLOCK.match(reply)
    if match is None:
        return reply
    start = 2 + int(match[1])
    length = int(reply[2:start])
    content = reply[start : start + length]
    if reply[:2] == b"#2" and length % 8 == 0:
        # The bridge's block of doubles.
        altered = struct.pack(f">{length // 8}d", *[_VALUES[kind]] * (length // 8))
    elif content[:1] in (b"+", b"-"):
        altered = _READING.sub(_TEXTS[kind], content)
        return reply[:2] + b"%0*d" % (int(match[1]), len(altered)) + altered + reply[start + length :]
    else:
        altered = _SAMPLES[kind] * length
    return reply[:start] + altered + reply[start + length :]
