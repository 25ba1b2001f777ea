"""The 16-character frame a Lutron instrument sends once per measurement.

0x02, '4' for the display, '1' for the upper one, two digits of annunciator, polarity '0' or '1', decimal point
'0' … '3', eight digits with the most significant first, 0x0D (maker's "RS232 output" sheet).
"""

from dataclasses import dataclass

from drivers.interfaces.text import text

START, END = b"\x02", b"\r"
LENGTH = 16


@dataclass(frozen=True)
class Frame:
    """Content of a display: `value` without its sign, its last digit `step`, and the two digits that stand for the unit."""

    annunciator: str
    value: float
    step: float


def parse_frame(raw: bytes) -> Frame:
    """Return what a frame says; raises ValueError naming the field that is wrong."""
    if len(raw) != LENGTH:
        raise ValueError(text("{count} characters instead of {length}", count=len(raw), length=LENGTH))
    if raw[:1] != START or raw[-1:] != END:
        raise ValueError(text("no frame between 0x02 and 0x0D"))
    if raw[1:3] != b"41":
        raise ValueError(text("display {raw} instead of b'41'", raw=repr(raw[1:3])))
    annunciator, polarity, point, digits = raw[3:5], raw[5:6], raw[6:7], raw[7:15]
    if not annunciator.isalnum():
        raise ValueError(text("annunciator {annunciator}", annunciator=repr(annunciator)))
    if polarity not in (b"0", b"1"):
        raise ValueError(text("polarity {polarity}", polarity=repr(polarity)))
    if point not in (b"0", b"1", b"2", b"3"):
        raise ValueError(text("decimal point {point}", point=repr(point)))
    if not digits.isdigit():
        raise ValueError(text("digits {digits}", digits=repr(digits)))
    scale = 10 ** int(point)
    return Frame(annunciator.decode("ascii"), int(digits) / scale, 1 / scale)
