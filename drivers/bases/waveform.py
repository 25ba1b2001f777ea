"""From the bytes of an oscilloscope's record to volts and seconds."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.interfaces.text import text
from drivers.transport.visa.replies import is_overrange, parse_numbers

#: Samples converted at a time: small enough that a block stays in the processor's cache between the two steps.
BLOCK = 32768

#: What a converter gives: whole numbers of one or two bytes, shape (n,).
Codes = NDArray[np.uint8] | NDArray[np.uint16]


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

    def value(self, code: int) -> float:
        """Return what a code stands for (V or A)."""
        return (code - self.y_reference) * self.y_increment + self.y_origin


def parse_preamble(reply: str, form: int, word: str) -> Preamble:
    """Return the scaling in a reply of ten numbers to :WAVeform:PREamble?; `form` is the number of the format `word`.

    Raises ValueError where there are not ten numbers, the format is another or an increment is not positive.
    Source: InfiniiVision Programmer's Guide, :WAVeform:PREamble.
    """
    said, _, points, _, x_increment, x_origin, x_reference, y_increment, y_origin, y_reference = parse_numbers(
        reply, 10
    )
    if any(is_overrange(scale) for scale in (x_increment, x_origin, y_increment, y_origin)):
        raise ValueError(text("no value (9.9E37)"))
    if said != form:
        raise ValueError(text("format {said:g} instead of {form} ({word})", said=said, form=form, word=word))
    if min(x_increment, y_increment, points) <= 0:
        raise ValueError(text("points and increments must be positive"))
    return Preamble(int(points), x_increment, x_origin, x_reference, y_increment, y_origin, y_reference)


def to_values(codes: Codes, preamble: Preamble) -> NDArray[np.float64]:
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
