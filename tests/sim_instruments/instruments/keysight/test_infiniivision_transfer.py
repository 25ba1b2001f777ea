"""A record's samples as bytes, to the byte, whatever the parts they are made in."""

import numpy as np
import pytest

from sim_instruments.instruments.oscilloscope.record import Vertical
from sim_instruments.instruments.oscilloscope.transfer import as_bytes, as_text, as_words, block

CODES = np.random.default_rng(5).integers(1, 65536, 40_000).astype(np.uint16)


def test_text_is_that_of_each_value() -> None:
    vertical = Vertical(scale=0.37, offset=-1.3, probe=10.0)
    values = (CODES.astype(float) / 256.0 - 128.0) * vertical.step + vertical.offset
    parts = list(as_text(CODES, vertical))
    assert b"".join(parts).decode() == ",".join(f"{value:+.5E}" for value in values)
    assert max(map(len, parts)) < 1 << 18


@pytest.mark.parametrize(
    ("unsigned", "least_first", "first"),
    [(True, True, b"\x34\x12"), (True, False, b"\x12\x34"), (False, False, b"\x92\x34")],
)
def test_words(unsigned: bool, least_first: bool, first: bytes) -> None:
    codes = np.concatenate([[0x1234], CODES, CODES]).astype(np.uint16)
    data = b"".join(as_words(codes, unsigned=unsigned, least_first=least_first))
    assert data[:2] == first
    back = np.frombuffer(data, "<u2" if least_first else ">u2")
    np.testing.assert_array_equal(back if unsigned else back ^ 0x8000, codes)


def test_bytes_never_show_a_hole() -> None:
    codes = np.array([0x0001, 0x0100, 0x80FF, 0xFFFF], dtype=np.uint16)
    assert b"".join(as_bytes(codes, unsigned=True)) == b"\x01\x01\x80\xff"
    assert b"".join(as_bytes(codes, unsigned=False)) == b"\x81\x81\x00\x7f"


def test_a_block_announces_its_length() -> None:
    assert bytes(block(6, [b"abc", b"def"])) == b"#800000006abcdef"
