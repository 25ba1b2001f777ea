"""The SCPI session: errors, silence, late and broken replies."""

import contextlib
from collections.abc import Callable, Iterator
from typing import Any, cast

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyvisa.constants import StatusCode

from bench.station.clock import SystemClock
from drivers.catalogue import Surroundings
from drivers.interfaces import CommunicationError, InstrumentError, ReportedError
from drivers.recognition import ScpiIdentity
from drivers.transport.visa.opening import identify, open_session
from drivers.transport.visa.replies import parse_error, parse_number, parse_numbers
from drivers.transport.visa.session import ScpiSession

ADDRESS = "TCPIP0::thing::inst0::INSTR"
IDENTITY = "Maker,Model,1,2"


@pytest.fixture
def dialogue(manager: Any, connect: Any, settings_class: Any) -> Iterator[tuple[ScpiSession, Any, list[Any]]]:
    traffic: list[Any] = []
    wire = connect(ADDRESS, settings_class(IDENTITY, {"A?": "1.5", "B?": "2.5"}))
    session = open_session(
        ADDRESS,
        Surroundings(SystemClock(), lambda: manager, traffic=lambda *entry: traffic.append(entry)),
        "thing",
        timeout=1.0,
    )
    session.identity_line()
    yield session, wire, traffic
    session.close()


def test_a_setting_is_confirmed_by_an_empty_error_queue(dialogue: Any) -> None:
    session, wire, traffic = dialogue
    wire.sent.clear()
    session.write("FREQ 20")
    assert wire.sent == ["FREQ 20", "SYST:ERR?"]
    assert traffic[-3:] == [("write", "FREQ 20"), ("write", "SYST:ERR?"), ("read", '+0,"No error"')]


def test_all_entries_of_the_error_queue_are_reported_with_instrument_and_command(dialogue: Any) -> None:
    session, wire, _ = dialogue
    wire.handler.errors.extend(['-222,"Data out of range"', '-113,"Undefined header"'])
    with pytest.raises(ReportedError) as caught:
        session.write("FREQ 1E9")
    assert str(caught.value) == (
        "thing after 'FREQ 1E9': the instrument reports -222 Data out of range; -113 Undefined header"
    )
    assert not wire.handler.errors


def test_a_reading_costs_one_exchange(dialogue: Any) -> None:
    session, wire, _ = dialogue
    wire.sent.clear()
    assert session.query_number("A?") == 1.5
    assert wire.sent == ["A?"]


def test_a_lost_reply_is_asked_for_once_more(dialogue: Any) -> None:
    session, wire, _ = dialogue
    wire.lost["A?"] = 1
    assert session.query_number("A?") == 1.5
    assert wire.clears == 1
    assert wire.sent.count("A?") == 2


def test_two_lost_replies_are_an_error_and_the_session_goes_on(dialogue: Any) -> None:
    session, wire, _ = dialogue
    wire.lost["A?"] = 2
    with pytest.raises(CommunicationError, match=r"thing after 'A\?': no reply .*, twice"):
        session.query_number("A?")
    assert session.query_number("B?") == 2.5


def test_what_must_not_be_repeated_is_not(dialogue: Any) -> None:
    session, wire, _ = dialogue
    wire.lost["A?"] = 1
    with pytest.raises(CommunicationError, match="no reply"):
        session.query("A?", repeatable=False)
    assert wire.sent.count("A?") == 1
    assert session.query_number("B?") == 2.5


def test_a_failed_write_is_not_repeated(dialogue: Any) -> None:
    session, wire, _ = dialogue
    wire.fail_write["OUTP ON"] = 1
    with pytest.raises(CommunicationError, match="could not be sent"):
        session.write("OUTP ON")
    assert "OUTP ON" not in wire.sent
    assert session.query_number("B?") == 2.5


@pytest.mark.parametrize("clear_drops", [True, False])
def test_a_late_reply_is_not_taken_for_another(dialogue: Any, clear_drops: bool) -> None:
    session, wire, _ = dialogue
    wire.clear_drops = clear_drops
    wire.late["A?"] = 1
    with pytest.raises(CommunicationError):
        session.query("A?", repeatable=False)
    assert session.query_number("B?") == 2.5
    assert session.query_number("A?") == 1.5


def test_ctrl_c_between_query_and_reply_leaves_no_stale_reply(dialogue: Any) -> None:
    session, wire, _ = dialogue
    wire.clear_drops = False
    wire.interrupt["A?"] = 1
    with pytest.raises(KeyboardInterrupt):
        session.query("A?")
    assert session.query_number("B?") == 2.5


def test_a_refused_query_is_reported_with_the_instruments_reason(dialogue: Any) -> None:
    session, wire, _ = dialogue
    with pytest.raises(ReportedError, match="-113 Undefined header"):
        session.query("NONSENSE?")
    assert wire.sent.count("NONSENSE?") == 1


def test_silence_of_the_whole_instrument_ends_and_recovers(dialogue: Any) -> None:
    session, wire, _ = dialogue
    wire.lost.update({"A?": 1, "*IDN?": 1})
    with pytest.raises(CommunicationError, match="does not answer any more"):
        session.query("A?")
    # Both replies come after all: the old identity must not end the search too early.
    wire.clear_drops = False
    wire.replies.extend([b"1.5\n", IDENTITY.encode() + b"\n"])
    assert session.query_number("B?") == 2.5
    assert session.query_number("A?") == 1.5


@pytest.mark.parametrize("reply", [b"1.5", b"", b"\xff\xfe\n", b"one\n", b"nan\n", b"1,2\n"])
def test_replies_that_are_no_number(dialogue: Any, reply: bytes) -> None:
    session, wire, _ = dialogue
    wire.handler = {"A?": reply, "*IDN?": IDENTITY.encode() + b"\n", "SYST:ERR?": b'0,""\n'}.get
    with pytest.raises(CommunicationError, match="thing after 'A\\?'"):
        session.query_number("A?")


def block(data: bytes) -> bytes:
    return b"#8" + b"%08d" % len(data) + data + b"\n"


@pytest.mark.parametrize("chunk", [None, 3, 7])
def test_a_block_keeps_every_byte(dialogue: Any, chunk: int | None) -> None:
    session, wire, _ = dialogue
    data = bytes(range(256)) + b"\n \r#0\n"
    wire.handler.values["DATA?"] = ""
    plain = wire.handler
    wire.handler = lambda message: block(data) if message == "DATA?" else plain(message)
    wire.chunk = chunk
    assert bytes(session.query_block("DATA?")) == data
    assert session.query_number("A?") == 1.5


@pytest.mark.parametrize(
    ("reply", "finding"),
    [
        (b"#3010abc", "only 3 of 10 announced bytes"),
        (b"#0abc\n", "must start with #<n>"),
        (b"12345\n", "must start with #<n>"),
        (b"#2x1\n", "must be digits"),
        (b"", "only 0 of 2"),
    ],
)
def test_broken_blocks(dialogue: Any, reply: bytes, finding: str) -> None:
    session, wire, _ = dialogue
    plain = wire.handler
    wire.handler = lambda message: reply if message == "DATA?" else plain(message)
    with pytest.raises(CommunicationError, match=finding):
        session.query_block("DATA?")
    assert session.query_number("A?") == 1.5


class Stream:
    """A resource that answers everything with the same bytes."""

    read_termination: str | None = None
    write_termination = "\n"
    timeout = 0.0
    session = 1

    def __init__(self, data: bytes) -> None:
        self.data = data
        self.left = b""

    @property
    def visalib(self) -> "Stream":
        return self

    def ignore_warning(self, *codes: Any) -> Any:
        return contextlib.nullcontext()

    def write(self, message: str) -> int:
        self.left = self.data
        return len(message)

    def read(self, session: int, count: int) -> Any:
        chunk, self.left = self.left[:count], self.left[count:]
        return chunk, 0

    def read_raw(self, size: int | None = None) -> bytes:
        line, separator, self.left = self.left.partition(b"\n")
        if not line + separator:
            raise OSError("nothing left")
        return line + separator

    def clear(self) -> None:
        self.left = b""

    def open(self) -> None:
        self.left = b""

    def close(self) -> None:
        self.left = b""


@given(st.binary(max_size=40) | st.binary(max_size=30).map(lambda data: b"#1" + data))
def test_whatever_arrives_only_instrument_errors_come_out(data: bytes) -> None:
    actions: list[Callable[[ScpiSession], object]] = [
        lambda session: session.query_block("D?"),
        lambda session: session.query_number("N?"),
        lambda session: session.query_numbers("N?", 2, 3),
        lambda session: session.check_errors(),
    ]
    for action in actions:
        session = ScpiSession(Stream(data), "thing")
        with contextlib.suppress(InstrumentError):
            action(session)


@given(st.text(max_size=30))
def test_parsers_refuse_with_value_error_only(text: str) -> None:
    for parse in (parse_number, parse_error, lambda text: parse_numbers(text, 3, 4)):
        try:
            parse(text)
        except ValueError:
            continue


@given(st.text(max_size=60) | st.lists(st.text(max_size=12), min_size=4, max_size=4).map(",".join))
def test_whatever_says_who_it_is(line: str) -> None:
    with contextlib.suppress(InstrumentError):
        identity = identify(
            ScpiSession(Stream(line.encode() + b"\n"), "thing"), ScpiIdentity(("keysight",), ("E36313A",)), None
        )
        assert identity.model.upper().startswith("E36313A")


@given(st.binary(max_size=30).map(lambda data: data + b"\n"))
def test_whatever_answers_a_connection_opened_anew(data: bytes) -> None:
    session = ScpiSession(Stream(data), "thing")
    with contextlib.suppress(InstrumentError):
        session.reopen()
        assert session.query("N?") == data.partition(b"\n")[0].decode("ascii").rstrip("\r")


@given(st.lists(st.floats(allow_nan=False, allow_infinity=False, width=32), min_size=3, max_size=3))
def test_numbers_survive_their_notation(values: list[float]) -> None:
    assert parse_numbers(",".join(f"{value:+.9E}" for value in values), 3) == pytest.approx(values, rel=1e-9)


def test_nothing_at_the_address(manager: Any) -> None:
    with pytest.raises(CommunicationError, match="cannot be opened at TCPIP0::nobody::inst0::INSTR"):
        open_session("TCPIP0::nobody::inst0::INSTR", Surroundings(SystemClock(), lambda: manager), "thing")


@pytest.mark.parametrize("sizes", [(2, 1, 3, 100), (1, 1, 1, 1, 1, 100), (100,), (7, 100)])
def test_a_block_is_whole_whatever_the_chunks(sizes: tuple[int, ...]) -> None:
    message = b"#210" + b"0123\n56789" + b"\n"
    left, cuts = [message], list(sizes)

    class Library:
        def read(self, session: int, count: int) -> tuple[bytes, StatusCode]:
            taken = min(count, cuts.pop(0) if cuts else 100)
            data, left[0] = left[0][:taken], left[0][taken:]
            return data, StatusCode.success if not left[0] else StatusCode.success_max_count_read

    class Resource:
        timeout = 1000.0
        read_termination: str | None = None
        visalib = Library()
        session = 1

        def write(self, message: str) -> int:
            return len(message)

        def ignore_warning(self, *_: StatusCode) -> Any:
            return contextlib.nullcontext()

    session = ScpiSession(cast("Any", Resource()), "scope")
    assert bytes(session.query_block("DATA?")) == b"0123\n56789"
    assert left == [b""]
