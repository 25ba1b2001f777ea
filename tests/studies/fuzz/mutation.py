"""Inputs for hypothesis: seeds with pieces cut out, put in, doubled and changed."""

from collections.abc import Sequence

from hypothesis import strategies as st

#: What breaks parsers of numbers, texts and tables.
_NASTY = (
    b"", b"\0", b"\n", b"\x1e", b"nan", b"inf", b"-inf", b"1e999", b"-0", b"9.9E37", b"9.91E37", b"1" * 400, b"1_0", b"\xff\xfe",
    b"\xc3\x28", b"[" * 3000, b"{" * 3000, b'"', b"'", b"=", b",", b";", b"true", b"null", b"[]", b"{}", b'"\\ud800"', b"{x:9}", b"#",
    b"1979-05-27", b"0x1F", b"\xed\xa0\x80", "Ω".encode(), b"-1", b"99999999999999999999", b"1e308", b"\r", b"#9999999999", b"#0",
)  # fmt: skip


@st.composite
def mutated(draw: st.DrawFn, seeds: Sequence[bytes]) -> bytes:
    """Draw a seed with up to six changes, or any bytes at all."""
    data = draw(st.sampled_from(seeds) | st.binary(max_size=200))
    for _ in range(draw(st.integers(0, 6))):
        start = draw(st.integers(0, len(data)))
        end = draw(st.integers(start, min(len(data), start + 40)))
        piece = draw(st.sampled_from(_NASTY) | st.binary(max_size=8) | st.just(data[start:end] * 2))
        data = data[:start] + piece + data[end:]
    return data[: 1 << 16]
