"""From the bytes of an oscilloscope's record to volts and seconds."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.interfaces.text import text
from drivers.transport.visa.replies import is_overrange, parse_numbers

#: Samples converted at a time: small enough that a block stays in the processor's cache between the two steps.
BLOCK = 32768


@dataclass(frozen=True)
class Preamble:
    """Scaling of a record: x in s, y in V or A (:WAVeform:PREamble?)."""

    points: int
    x_increment: float
    x_origin: float
    x_reference: float
    y_increment: float
    y_origin: float
    y_reference: float


def parse_preamble(reply: str) -> Preamble:
    """Return the scaling in a reply of :WAVeform:PREamble?.

    Raises ValueError where there are not ten numbers, the format is not WORD or an increment is not positive.
    Source: InfiniiVision Programmer's Guide, :WAVeform:PREamble.
    """
    form, _, points, _, x_increment, x_origin, x_reference, y_increment, y_origin, y_reference = parse_numbers(
        reply, 10
    )
    if any(is_overrange(scale) for scale in (x_increment, x_origin, y_increment, y_origin)):
        raise ValueError(text("no value (9.9E37)"))
    if form != 1:
        raise ValueError(text("format {form:g} instead of 1 (WORD)", form=form))
    if min(x_increment, y_increment, points) <= 0:
        raise ValueError(text("points and increments must be positive"))
    return Preamble(int(points), x_increment, x_origin, x_reference, y_increment, y_origin, y_reference)


def codes_from_block(block: bytes | bytearray | memoryview) -> NDArray[np.uint16]:
    """Return the unsigned 16-bit codes in a block, least significant byte first, without copying.

    Raises ValueError where the number of bytes is odd.
    """
    return np.frombuffer(block, dtype="<u2")


def to_values(codes: NDArray[np.uint16], preamble: Preamble) -> NDArray[np.float64]:
    """Return (code − yref)·yinc + yorig (V or A), shape (n,)."""
    values = np.empty(codes.shape, dtype=np.float64)
    # yref is a whole code and yorig/yinc is not: subtracting first keeps a code equal to yref exact.
    for start in range(0, codes.size, BLOCK):
        part = values[start : start + BLOCK]
        np.subtract(codes[start : start + BLOCK], preamble.y_reference, out=part)
        part *= preamble.y_increment
        part += preamble.y_origin
    return values


def to_time(count: int, preamble: Preamble) -> NDArray[np.float64]:
    """Return (i − xref)·xinc + xorig (s), shape (count,); 0 at the trigger."""
    time = np.arange(count, dtype=np.float64)
    time -= preamble.x_reference
    time *= preamble.x_increment
    time += preamble.x_origin
    return time
