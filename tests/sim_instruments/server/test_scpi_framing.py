import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim_instruments.scpi.framing import MessageSplitter


def split(*pieces: bytes, limit: int = 1000) -> list[bytes | None]:
    splitter = MessageSplitter(limit)
    return [message for piece in pieces for message in splitter.feed(piece)]


@pytest.mark.parametrize(
    ("stream", "messages"),
    [
        (b"*IDN?\nVOLT 5\n", [b"*IDN?\n", b"VOLT 5\n"]),
        (b"*IDN?", []),
        (b"DISP 'a\"b'\nX\n", [b"DISP 'a\"b'\n", b"X\n"]),
        (b"DISP 'never closed\nX'\n", [b"DISP 'never closed\n", b"X'\n"]),
        (b"DATA #15a\nb\nc\nX\n", [b"DATA #15a\nb\nc\n", b"X\n"]),
        (b"N #HFF\nX\n", [b"N #HFF\n", b"X\n"]),
        (b"N #2\nX\n", [b"N #2\n", b"X\n"]),
        (b"#", []),
        (b"DATA #3", []),
        (b"DATA #299abc\n", []),
    ],
)
def test_messages_end_at_newlines_outside_strings_and_blocks(stream: bytes, messages: list[bytes]) -> None:
    assert split(stream) == messages


@given(
    st.lists(
        st.sampled_from([b"*IDN?\n", b"A 'x\"'\n", b"D #13\n\n\n\n", b"\xff\x00", b"'", b"#1", b"#", b"7\n", b"\n"])
    ),
    st.data(),
)
def test_how_the_stream_is_cut_does_not_matter(parts: list[bytes], data: st.DataObject) -> None:
    stream = b"".join(parts)
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)))))
    pieces = [stream[start:end] for start, end in zip([0, *cuts], [*cuts, len(stream)], strict=True)]
    assert split(*pieces) == split(stream)


def test_a_message_that_is_too_long_is_dropped_up_to_its_end() -> None:
    assert split(b"A" * 11, b"B" * 50, b"C\nX\n", limit=10) == [None, b"X\n"]
    assert split(b"A" * 11 + b"\nX\n", limit=10) == [None, b"X\n"]
    # A block that announces more than fits is given up, and its newlines count again.
    assert split(b"#9999999999" + b"z" * 20, b"zz\nX\n", limit=10) == [None, b"X\n"]


@given(st.lists(st.binary(max_size=40)))
def test_nothing_is_kept_beyond_the_limit(pieces: list[bytes]) -> None:
    splitter = MessageSplitter(16)
    for piece in pieces:
        for message in splitter.feed(piece):
            assert message is None or len(message) <= 16
        assert len(splitter._buffer) <= 16
