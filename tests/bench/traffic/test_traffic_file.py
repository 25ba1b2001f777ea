"""The file: any bytes come back, and what is no recording is refused with its place."""

import os
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bench.i18n.errors import FileError
from bench.station.clock import SystemClock
from bench.traffic import growing_file
from bench.traffic.growing_file import GrowingFile
from bench.traffic.traffic_file import Kind, SessionRecording, TrafficLine, parse_recording, read_recording
from drivers.interfaces import Role

TABLES = {"voltmeter": {"driver": "keysight-34461a", "address": "TCPIP0::voltmeter::inst0::INSTR"}}
KINDS: list[Kind] = [">", "<", "~", "!"]


def recording_of(*lines: TrafficLine) -> SessionRecording:
    return SessionRecording(TABLES, {Role.VOLTMETER: "visa"}, lines, {"made": "today"})


@given(st.lists(st.tuples(st.floats(0.0, 1e6), st.sampled_from(KINDS), st.binary(max_size=200))))
def test_any_bytes_come_back(lines: list[tuple[float, Kind, bytes]]) -> None:
    made = recording_of(*(TrafficLine(time, Role.VOLTMETER, kind, data) for time, kind, data in lines))
    read = parse_recording(made.text(), "any.traffic")
    assert [(line.kind, line.content) for line in read.lines] == [(kind, data) for _, kind, data in lines]
    assert read.text() == made.text()


def test_how_it_looks() -> None:
    block = b"#800000100" + bytes(range(128, 228)) + b"\n"
    made = recording_of(
        TrafficLine(0.0, Role.VOLTMETER, "=", b"configure(full_scale=0.1)"),
        TrafficLine(0.0104, Role.VOLTMETER, ">", b"CONF:VOLT:DC 0.1\r\n"),
        TrafficLine(12.0, Role.VOLTMETER, "<", block),
    )
    rows = made.text().splitlines()
    assert rows[0] == "# motorbench traffic 1"
    assert rows[rows.index("--- traffic") + 1 :] == [
        "     0.000 voltmeter = configure(full_scale=0.1)",
        "     0.010 voltmeter > CONF:VOLT:DC 0.1\\r\\n",
        "    12.000 voltmeter <x " + block[:64].hex(" "),
        "| " + block[64:].hex(" "),
        "--- end of 3 lines",
    ]


GOOD = recording_of(
    TrafficLine(0.0, Role.VOLTMETER, "=", b"open()"), TrafficLine(0.0, Role.VOLTMETER, ">", b"*IDN?\n")
).text()


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("", "first line is not"),
        ("[station]\nname = 'a station'\n", "first line is not '# motorbench traffic 1'"),
        (GOOD.replace("traffic 1", "traffic 2", 1), "version 2; this motorbench reads 1"),
        (GOOD.replace("traffic 1", "traffic one", 1), "first line is not"),
        (GOOD[: GOOD.index("--- traffic")], "ends early"),
        (GOOD[:-10], "ends early"),
        (GOOD[: GOOD.index("     0.000 voltmeter >")], "ends early"),
        (GOOD.replace("2 lines", "3 lines"), "lines are missing"),
        (GOOD.replace("voltmeter > *IDN?", "voltmeter ? *IDN?"), "line 14: no line of a recording"),
        (GOOD.replace("voltmeter > *IDN?", "voltmetre > *IDN?"), "line 14: no line of a recording"),
        (GOOD.replace("> *IDN?", "> *IDN\\u263a"), "line 14:"),
        (GOOD.replace("> *IDN?\\n", ">x 2A 4"), "line 14:"),
        (GOOD.replace("*IDN?\\n", "*IDN\\x"), "line 14:"),
        (GOOD.replace('"visa"', '"pigeon"'), "unknown carrier pigeon"),
        (GOOD.replace('voltmeter = "visa"', ""), "[instruments.voltmeter] or its carrier is missing"),
        (GOOD.replace("[recording.carriers]", "[recording.carrier]"), "is missing or wrong"),
        (GOOD.replace("keysight-34461a", "acme"), "is no driver for this role"),
        (GOOD.replace("[instruments.voltmeter]", "[instruments.supply]"), "keysight-34461a"),
        (GOOD.replace('"today"', "today"), "not valid TOML"),
    ],
)
def test_what_is_no_recording_is_named(content: str, said: str) -> None:
    with pytest.raises(FileError) as raised:
        parse_recording(content, "sent.traffic")
    assert str(raised.value).startswith("sent.traffic")
    assert said in str(raised.value)


def test_a_file_that_cannot_be_written(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="cannot be written"):
        GrowingFile(tmp_path / "nowhere" / "one.traffic", TABLES)


SAID = (
    TrafficLine(0.0, Role.VOLTMETER, "@", b"visa"),
    TrafficLine(0.0, Role.VOLTMETER, "=", b"open()"),
    TrafficLine(0.1, Role.VOLTMETER, ">", b"*IDN?\n"),
    TrafficLine(0.2, Role.VOLTMETER, "<", b"Keysight Technologies,34461A,MY53201234,A.03\n"),
    TrafficLine(0.3, Role.VOLTMETER, "#", "raised InstrumentError: 5 Ω MY53201234".encode()),
    TrafficLine(0.4, Role.VOLTMETER, "<", bytes(range(128, 256)) * 2),
)


def test_a_file_that_grows_is_read_wherever_it_was_cut(tmp_path: Path) -> None:
    file = tmp_path / "one.traffic"
    growing = GrowingFile(file, {**TABLES, "supply": {"driver": "no-such-driver"}})
    for line in SAID:
        growing.take(line)
    while not file.read_bytes().endswith(b"fe ff\n"):
        SystemClock().sleep(0.001)
    whole = file.read_bytes()
    assert b"MY53201234" not in whole
    begin, kept = whole.index(b"--- traffic\n") + 12, []
    for end in range(begin, len(whole) + 1):
        file.write_bytes(whole[:end])
        read = read_recording(file)
        assert read.unfinished
        for line, said in zip(read.lines, SAID[1:], strict=False):
            assert (line.kind, len(line.content)) == (said.kind, len(said.content)), end
        kept.append(len(read.lines))
    # The last line's bytes fill their rows: nobody can tell that none is missing.
    assert sorted(set(kept)) == [0, 1, 2, 3, 4]
    growing.finish(recording_of(*SAID[1:]))
    assert not read_recording(file).unfinished
    assert len(read_recording(file).lines) == 5


def test_a_file_that_grows_is_synced_while_it_does_and_at_its_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sizes: list[int] = []
    monkeypatch.setattr(growing_file, "SYNC_INTERVAL", 0.001)
    monkeypatch.setattr("os.fsync", lambda file: sizes.append(os.fstat(file).st_size))
    file = tmp_path / "one.traffic"
    growing = GrowingFile(file, TABLES)
    head = file.stat().st_size
    growing.take(SAID[1])
    while not any(head < size for size in sizes):
        SystemClock().sleep(0.001)
    sizes.clear()
    growing.finish(recording_of(*SAID[1:]))
    assert file.stat().st_size in sizes


def test_a_file_is_written_and_read(tmp_path: Path) -> None:
    (tmp_path / "one.traffic").write_text(GOOD)
    assert read_recording(tmp_path / "one.traffic").text() == GOOD
