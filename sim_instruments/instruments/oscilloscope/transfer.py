"""A record's samples as the bytes of its transfer, made part by part."""

from collections.abc import Iterable, Iterator

import numpy as np
from numpy.typing import NDArray

from sim_instruments.instruments.oscilloscope.record import Vertical, WordArray
from sim_instruments.scpi.long_reply import LongReply

#: Bytes of one sample as text with its comma, like +1.23456E+00, whatever its value.
TEXT_WIDTH = 13
#: Samples converted at a time, and as text, which is longer.
_PART, _PART_OF_TEXT = 1 << 18, 1 << 14
_CODES = 1 << 16


def block(length: int, parts: Iterable[bytes]) -> LongReply:
    """Return parts of `length` bytes together as a definite length block (IEEE 488.2, 8.7.9)."""
    return LongReply(_headed(b"#8%08d" % length, parts))


def as_words(words: WordArray, *, unsigned: bool, least_first: bool) -> Iterator[bytes]:
    """Give the samples as words of 16 bits."""
    for part in _parts(words, _PART):
        yield (part if unsigned else part ^ 0x8000).astype("<u2" if least_first else ">u2").tobytes()


def as_bytes(words: WordArray, *, unsigned: bool) -> Iterator[bytes]:
    """Give the samples as bytes."""
    for part in _parts(words, _PART):
        # Code 0 stands for a hole, so what is clipped low becomes 1.
        codes = ((part >> 8) | (part < 0x100)).astype("u1")
        yield (codes if unsigned else codes ^ 0x80).tobytes()


def as_text(words: WordArray, vertical: Vertical) -> Iterator[bytes]:
    """Give the samples as numbers (V or A) with commas between them."""
    # A converter has few codes and a record many samples: each code is put into words once.
    text: NDArray[np.bytes_] = np.zeros(_CODES, dtype=f"S{TEXT_WIDTH}")
    known = np.zeros(_CODES, dtype=bool)
    last = len(words) - 1
    for place, part in enumerate(_parts(words, _PART_OF_TEXT)):
        present = np.zeros(_CODES, dtype=bool)
        present[part] = True
        codes = np.flatnonzero(present & ~known)
        known[codes] = True
        values = (codes.astype(float) / 256.0 - 128.0) * vertical.step + vertical.offset
        text[codes] = [f"{value:+.5E}," for value in values.tolist()]
        made = text[part].tobytes()
        yield made[:-1] if place * _PART_OF_TEXT + len(part) > last else made


def _parts(words: WordArray, size: int) -> Iterator[WordArray]:
    return (words[start : start + size] for start in range(0, len(words), size))


def _headed(header: bytes, parts: Iterable[bytes]) -> Iterator[bytes]:
    yield header
    yield from parts
