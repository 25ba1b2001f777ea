"""What a scan makes of instruments that answer garbage, half a line, late or nothing."""

import socket
import threading
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bench.discovery import scpi
from bench.discovery.findings import FoundInstrument, ScanReport
from bench.discovery.inquiry import shown
from bench.discovery.matching import KnownInstruments
from bench.discovery.scan import ScanRequest
from bench.discovery.station_draft import draft
from bench.safety.ownership.claims import Claim
from bench.safety.ownership.owner import owning
from bench.safety.ownership.state_folder import StateFolder
from bench.station.computer import Computer
from bench.station.station_file import make_station
from bench.station.visa_library import StationVisa
from drivers.catalogue import Driver
from drivers.interfaces.text import Text, text
from drivers.transport.canonical_address import canonical_addresses
from procedures.core.bench import Role as BenchRole
from tests.bench.discovery.places import OURS, answering, inquiry, listening, looked, terminal
from tests.command_line import Call


@pytest.mark.parametrize(
    ("data", "drivers", "near", "said"),
    [
        (b"Keysight Technologies,E36312A,MY1,2.0\n", ["keysight-e36300"], (), "Keysight Technologies,E36312A,MY1,2.0"),
        (b"Agilent Technologies,E4980A,MY2,A.02\r\n", ["keysight-e4980a"], (), "Agilent Technologies,E4980A,MY2,A.02"),
        (b"RIGOL TECHNOLOGIES,DP832,DP8A,00.01\n", [], (), "RIGOL TECHNOLOGIES,DP832,DP8A,00.01"),
        (b"\xff\x00\x1b[2Jgarbage\x07\n", [], (), "ÿ\\x00\\x1b[2Jgarbage\\x07"),
        (b"KEYSIGHT TECH", [], (), "KEYSIGHT TECH"),
    ],
)
def test_an_answer_is_shown_and_matched(
    data: bytes, drivers: list[str], near: tuple[str, ...], said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(scpi, "ANSWER_TIME", 0.5)
    with listening(answering(data)) as port:
        report = looked(ScanRequest(hosts=(("127.0.0.1", port),), named_only=True))
    (found,) = report.found
    assert [match.driver.name for match in found.matches] == drivers
    assert (found.near, str(found.said)) == (near, said)


def test_a_relative_names_its_maker_s_drivers_the_nearest_first() -> None:
    _, matches, near = KnownInstruments(OURS).scpi("KEYSIGHT TECHNOLOGIES,E36233A,MY3,1.0")
    assert matches == ()
    assert near[0] == "keysight-e36300"
    assert all(name.startswith("keysight-") for name in near)


@pytest.mark.parametrize(
    "answer", [answering(b"Keysight Technologies,34461A,MY1,1\n", late=0.3), lambda line: line.recv(1)]
)
def test_who_answers_late_or_not_at_all_did_not_answer(
    answer: Callable[[socket.socket], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(scpi, "ANSWER_TIME", 0.1)
    monkeypatch.setattr(scpi, "QUESTION_TIME", 1.0)
    with listening(answer) as port:
        asked = inquiry()
        scpi.ask_address(asked, StationVisa("@py"), f"TCPIP0::127.0.0.1::{port}::SOCKET")
    (question,) = asked.report.asked
    assert (question.answered, str(question.outcome), asked.report.found) == (False, "no answer", [])


def test_a_port_that_is_closed_says_so() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    report = looked(ScanRequest(hosts=(("127.0.0.1", port),), named_only=True))
    assert report.found == []
    assert {str(one.outcome) for one in report.asked} == {"the connection was refused: nothing listens there"}


def test_a_library_that_hangs_does_not_hold_the_scan_up() -> None:
    asked, forever = inquiry(seconds=0.2), threading.Event()
    assert asked.ask("a bus", text("who is there"), forever.wait, 10.0) is None
    assert asked.ask("another", text("who is there"), forever.wait, 10.0) is None
    forever.set()
    assert [str(one.outcome) for one in asked.report.asked] == ["no answer in time"]
    assert [one.where for one in asked.report.unlooked] == ["another"]


def test_ctrl_c_gives_what_was_found_so_far() -> None:
    def interrupted(_: Text) -> None:
        raise KeyboardInterrupt

    with listening(answering(b"Keysight Technologies,34461A,MY1,1\n")) as port:
        request = ScanRequest(hosts=(("127.0.0.1", port),), modbus=("tcp://127.0.0.1:1",), named_only=True)
        report = looked(request, say=interrupted)
    assert report.interrupted
    assert [one.matches[0].driver.name for one in report.found] == ["keysight-34461a"]


def test_what_another_has_is_not_asked(tmp_path: Path) -> None:
    state = StateFolder(tmp_path)
    address = "TCPIP0::192.0.2.7::5025::SOCKET"
    with owning(state, "motorbench run") as other, owning(state, "motorbench station scan") as mine:
        other.claim([Claim("supply", frozenset(canonical_addresses(address)))])
        asked = inquiry(owner=mine)
        scpi.ask_address(asked, StationVisa("@py"), address)
    assert asked.report.asked == []
    assert "in use by" in str(asked.report.unlooked[0].why)


def test_an_instrument_on_the_usb_that_may_not_be_opened_is_told_and_nothing_else_there_is(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for bus, kind in (("1-2", "fe"), ("1-3", "09")):
        interface = tmp_path / f"sys/bus/usb/devices/{bus}:1.0"
        for path, content in (
            (interface.with_name(bus) / "idVendor", "2a8d"),
            (interface.with_name(bus) / "idProduct", f"12{bus[-1]}2"),
            (interface.with_name(bus) / "busnum", "1"),
            (interface.with_name(bus) / "devnum", bus[-1]),
            (interface / "bInterfaceClass", kind),
            (interface / "bInterfaceSubClass", "03"),
        ):
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(content + "\n", encoding="ascii")
    monkeypatch.setattr("bench.discovery.scpi.visa_addresses", lambda *_: [])
    monkeypatch.setattr("bench.discovery.announced.announced", lambda *_: [])
    report = looked(ScanRequest(), computer=Computer(tmp_path))
    (place,) = [one for one in report.unlooked if one.where.startswith("USB 0x")]
    assert place.where == "USB 0x2A8D::0x1222"
    assert "60-motorbench.rules" in str(place.why)


@given(
    st.binary(max_size=80)
    | st.builds(b"Keysight Technologies,34461A,%b,%b".__mod__, st.tuples(*[st.binary(max_size=12)] * 2))
)
def test_whatever_is_answered_the_proposed_file_holds(answer: bytes) -> None:
    asked = inquiry()
    found = scpi.judge(asked, ("TCPIP0::192.0.2.1::5025::SOCKET",), answer.decode("latin-1").strip())
    node = FoundInstrument(("can://x/y?node=1",), text("device {name}", name=answer.decode("latin-1")))
    content = draft(ScanReport([found, node]), "bench")
    made = make_station(tomllib.loads(content), "found.toml", content.encode())
    assert len(made.entries) == len(found.matches)


def test_several_instruments_of_one_role_are_all_in_the_file() -> None:
    known, lines = KnownInstruments(OURS), ("A1", "A2")
    report = ScanReport()
    for number, serial in enumerate(lines):
        identity, matches, near = known.scpi(f"Keysight Technologies,34461A,{serial},1.0")
        report.found.append(
            FoundInstrument((f"USB0::1::2::{serial}::INSTR",), Text(f"number {number}"), identity, matches, near)
        )
    report.found.append(FoundInstrument(("TCPIP0::h::5025::SOCKET",), Text("line\nnoise"), None, (), ()))
    content = draft(report, 'the "new" bench')
    made = make_station(tomllib.loads(content), "found.toml", content.encode())
    assert made.name == 'the "new" bench'
    assert made.entries[BenchRole.VOLTMETER].address.endswith("A1::INSTR")
    assert "[instruments.voltmeter.34461a_a2]" in content
    assert "# no driver recognises TCPIP0::h::5025::SOCKET: line\n# noise" in content


@pytest.mark.parametrize(
    "driver", [d for d in OURS if d.needs_address and d.name != "capture-files"], ids=lambda d: d.name
)
def test_each_driver_of_an_instrument_with_an_address_says_how_it_is_recognised(driver: Driver) -> None:
    assert driver.recognised_by


@pytest.mark.parametrize(
    ("words", "wrong"),
    [
        (("--units", "0-300"), "--units 0-300"),
        (("--units", "many"), "--units many"),
        (("--within", "0"), "--within 0"),
        (("--modbus", "http://x"), "--modbus http://x"),
        (("--can", "can0"), "--can can0"),
        (("--host", "a:99999"), "--host a:99999"),
        (("--host", "a/b"), "--host a/b"),
    ],
)
def test_what_cannot_be_looked_at_is_refused_by_name(words: tuple[str, str], wrong: str, call: Call) -> None:
    status, _, err = call("station", "scan", "--named-only", *words)
    assert status == 2
    assert wrong in err


def test_answers_are_shown_on_one_line_and_cut() -> None:
    assert shown(b"a\r\nb\x00") == "a\\r\\nb\\x00"
    assert len(shown("x" * 5000)) == 201


def test_a_station_s_own_addresses_are_told_apart_by_what_answers(call: Call, tmp_path: Path) -> None:
    station = tmp_path / "station.toml"
    with listening(answering(b"Keysight Technologies,34461A,MY1,1\n")) as port, terminal() as (_, silent):
        there = f"TCPIP0::127.0.0.1::{port}::SOCKET"
        station.write_text(
            f"""
            station = {{ name = "x" }}
            [instruments]
            voltmeter = {{ driver = "keysight-34461a", address = "{there}" }}
            supply = {{ driver = "keysight-e36300", address = "{there}" }}
            oscilloscope = {{ driver = "manual" }}
            dynamometer = {{ driver = "delta-dyn200", address = "rtu://{silent}?baudrate=9600", maximum_speed = 1.0 }}
            """,
            encoding="utf-8",
        )
        status, out, _ = call("station", "scan", "--station", str(station), "--named-only", "--language", "en")
    assert status == 1
    assert f"✓ voltmeter         {there}  answers" in out
    assert f"✗ supply            {there}  the instrument that answers is not one for this driver" in out
    assert f"✗ dynamometer       rtu://{silent}?baudrate=9600  does not answer" in out
    assert "oscilloscope" not in out
    assert f"{silent}: a serial port" not in out
