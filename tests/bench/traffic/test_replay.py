"""A session on the virtual bench, recorded and replayed through the same drivers: the same, byte for byte; another driver is found."""

import threading
from typing import Any

import pytest

from bench.i18n.errors import FileError
from bench.traffic.replay import Difference, replay
from bench.traffic.traffic_file import SessionRecording, parse_recording
from drivers.interfaces import InstrumentError, Role
from sim_instruments.bench import VirtualBench
from sim_instruments.faults.line_faults import Fault
from sim_instruments.recorded.replies import Exchange, RecordedReplies, RecordedSession
from tests.bench.traffic.sessions import Instruments, failing, recorded


def again(recording: SessionRecording, *changes: tuple[str, str]) -> SessionRecording:
    """Return a recording written and read, with the first place of each text changed."""
    content = recording.text()
    for before, after in changes:
        assert before in content
        content = content.replace(before, after, 1)
    return parse_recording(content, "again.traffic")


def difference(recording: SessionRecording, role: Role, *, tolerant: bool = False) -> Difference | None:
    """Return where a role's driver does something else."""
    return {one.role: one.difference for one in replay(recording, tolerant=tolerant)}[role]


def test_the_replay_of_every_role_is_the_recording(recording: SessionRecording) -> None:
    read = again(recording)
    assert {line.role for line in read.lines} == set(Role) - {Role.DRIVE}
    for one in replay(read):
        assert one.difference is None
        assert [(line.kind, line.words) for line in one.lines] == [
            (line.kind, line.words) for line in read.of(one.role)
        ]


#: Each role with a call that reads, and what names the message of it that a fault is to strike.
READ: dict[Role, tuple[str, str]] = {
    Role.SUPPLY: ("measure_voltage", "MEAS:VOLT"),
    Role.VOLTMETER: ("measure_voltage", "READ"),
    Role.DYNAMOMETER: ("measure", "read 2"),
    Role.INVERTER: ("measure_frequency", "read 606CH"),
    Role.TACHOMETER: ("measure_speed", "frame"),
}


@pytest.mark.parametrize("kind", ["silence", "half", "garbage", "late", "stale", "not_a_number"])
@pytest.mark.parametrize("role", READ)
def test_the_replay_of_a_misbehaving_instrument_is_the_recording(role: Role, kind: str) -> None:
    call, struck = READ[role]

    def use(bench: VirtualBench, instruments: Instruments) -> None:
        instrument = instruments[role]
        if role is Role.VOLTMETER:
            instrument.configure(0.1)
        bench.faults(role.value).add(Fault.on(kind, struck, delay=30.0))
        for _ in range(3):
            try:
                getattr(instrument, call)()
            except InstrumentError:
                continue

    (replayed,) = replay(again(recorded(use, role)))
    assert replayed.difference is None
    assert any(line.words.startswith(("gave", "raised")) for line in replayed.lines)


@pytest.mark.parametrize("struck", ["*IDN?", "READ?"])
def test_a_connection_that_breaks(struck: str) -> None:
    def use(bench: VirtualBench, instruments: Instruments) -> None:
        meter = instruments[Role.VOLTMETER]
        meter.configure(0.1)
        # Pulled before the next message, or while its reply is waited for.
        pull = bench.connection("voltmeter").pull
        if struck == "READ?":
            bench.clock.call_at(bench.clock.now() + 1e-3, pull)
        else:
            pull()
        for _ in range(2):
            with failing():
                meter.measure_voltage()

    made = recorded(use, Role.VOLTMETER)
    assert any(line.kind == "!" for line in made.lines)
    (replayed,) = replay(again(made))
    assert replayed.difference is None


def test_another_message_is_named_with_its_place(recording: SessionRecording) -> None:
    found = difference(again(recording, ("TRIG:SOUR BUS", "TRIG:SOUR EXT")), Role.LCR_METER)
    assert found is not None
    assert (str(found.before), str(found.now)) == ("> TRIG:SOUR EXT\\n", "> TRIG:SOUR BUS\\n")
    lines = again(recording, ("TRIG:SOUR BUS", "TRIG:SOUR EXT")).text().splitlines()
    assert lines[int(str(found.place).removeprefix("line ")) - 1].endswith("> TRIG:SOUR EXT\\n")


def test_a_message_that_is_sent_no_more_or_besides() -> None:
    def use(_: VirtualBench, instruments: Instruments) -> None:
        instruments[Role.VOLTMETER].configure(0.1)

    content = recorded(use, Role.VOLTMETER).text()
    rows = content.splitlines()
    last = rows[-2]
    assert last.endswith("> SYST:LOC\\n")
    count = int(rows[-1].split()[3])
    less = "\n".join([*rows[:-2], f"--- end of {count - 1} lines", ""])
    found = difference(parse_recording(less, "less.traffic"), Role.VOLTMETER)
    assert found is not None
    assert (str(found.place), str(found.before), str(found.now)) == ("after the last line", "nothing", "> SYST:LOC\\n")
    more = "\n".join([*rows[:-1], last.replace("SYST:LOC", "*RST"), f"--- end of {count + 1} lines", ""])
    found = difference(parse_recording(more, "more.traffic"), Role.VOLTMETER)
    assert found is not None
    assert (str(found.before), str(found.now)) == ("> *RST\\n", "nothing")


def test_another_reading_of_the_same_answer(recording: SessionRecording) -> None:
    value = next(line.words for line in recording.of(Role.VOLTMETER) if line.words.startswith("gave "))
    other = again(recording, (value, 'gave {"value":1.0,"unit":"V"}'))
    found = difference(other, Role.VOLTMETER)
    assert found is not None
    assert str(found.now) == f"# {value}"
    assert difference(other, Role.VOLTMETER, tolerant=True) is None


def test_other_numbers_are_tolerated_where_that_is_asked_for(recording: SessionRecording) -> None:
    role_and_change: dict[Role, tuple[str, str]] = {
        Role.SUPPLY: ("configure(voltage=1.0, ", "configure(voltage=1.1, "),
        Role.DYNAMOMETER: ("driving_speed(speed=50.0)", "driving_speed(speed=52.0)"),
        Role.INVERTER: ("driving_frequency(frequency=2.0", "driving_frequency(frequency=2.5"),
    }
    for role, change in role_and_change.items():
        other = again(recording, change)
        assert difference(other, role) is not None
    # The supply reads its set point back: what it is tolerant of is the message, not the answer.
    sent = again(recording, ("VOLT:PROT 1.6", "VOLT:PROT 1.60"))
    assert difference(sent, Role.SUPPLY) is not None
    assert difference(sent, Role.SUPPLY, tolerant=True) is None


@pytest.mark.parametrize(
    "call",
    [
        "__init__()",
        "measure",
        "brake(1)",
        "measure_voltage(__import__('os'))",
        "measure_voltage(1",
        "configure(full_scale='x')",
    ],
)
def test_what_is_no_call_of_the_role_is_refused(recording: SessionRecording, call: str) -> None:
    other = again(recording, ("voltmeter = measure_voltage()", f"voltmeter = {call}"))
    with pytest.raises(FileError, match=r"again\.traffic: line \d+: .* is no call of voltmeter"):
        replay(other)


def test_a_node_without_a_number_is_refused(recording: SessionRecording) -> None:
    with pytest.raises(FileError, match=r"again\.traffic: .*is no CAN address"):
        replay(again(recording, ("?node=5", "?knot=5")))


def test_what_is_no_frame_of_a_bus_is_refused(recording: SessionRecording) -> None:
    with pytest.raises(FileError, match=r"again\.traffic: line \d+: no line of a recording: '585#43GG"):
        replay(again(recording, ("585#43", "585#43GG")))


def test_what_feeds_a_watchdog_takes_no_answers_away() -> None:
    exchanges = [Exchange(0.0, b"1", (str(number).encode(),)) for number in range(3)]
    replies = RecordedReplies(RecordedSession("modbus", exchanges), caller=threading.get_ident())
    beside: list[Exchange] = []
    given = []
    for _ in range(4):
        thread = threading.Thread(target=lambda: beside.append(replies.answer(b"1")))
        thread.start()
        thread.join()
        given.append(replies.answer(b"1").replies)
    assert given == [(b"0",), (b"1",), (b"2",), (b"2",)]
    assert [one.replies for one in beside] == [(b"0",), (b"0",), (b"1",), (b"2",)]


def test_calls_beside_those_of_a_session_take_no_answers_away(recording: SessionRecording) -> None:
    rows: list[Any] = recording.text().splitlines()
    first = next(number for number, row in enumerate(rows) if " dynamometer >x" in row)
    beside = [rows[first].replace(" >x", " ~x"), rows[first + 1].replace("00 00", "FF FF")]
    count = int(rows[-1].split()[3])
    made = [*rows[: first - 1], *beside, *rows[first - 1 : -1], f"--- end of {count + 2} lines", ""]
    assert difference(parse_recording("\n".join(made), "again.traffic"), Role.DYNAMOMETER) is None
