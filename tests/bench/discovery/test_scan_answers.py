"""What a scan makes of instruments that answer garbage, half a line, late or nothing, and of places it may not touch."""

import os
import pty
import socket
import struct
import threading
import time
import tomllib
import tty
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bench.discovery import can_nodes, modbus_line, scpi, serial_lines
from bench.discovery.findings import FoundInstrument, ScanReport
from bench.discovery.inquiry import Inquiry, shown
from bench.discovery.matching import KnownInstruments
from bench.discovery.scan import ScanRequest, scan
from bench.discovery.station_draft import draft
from bench.plugins.catalogues import installed
from bench.safety.ownership.claims import Claim
from bench.safety.ownership.owner import Unowned, owning
from bench.safety.ownership.state_folder import StateFolder
from bench.station.clock import SystemClock
from bench.station.computer import Computer
from bench.station.station_file import make_station
from bench.station.visa_library import StationVisa
from drivers.catalogue import Driver
from drivers.interfaces import Role
from drivers.interfaces.text import Text, text
from drivers.recognition import SerialTalk
from drivers.transport.canonical_address import canonical_addresses
from procedures.core.bench import Role as BenchRole
from tests.command_line import Call

OURS = [driver for drivers in installed().drivers.values() for driver in drivers]
VESC_QUESTION = bytes.fromhex("02 01 00 00 00 03")


class Nowhere(Computer):
    """A computer with what a test names and nothing else."""

    def __init__(self, ports: dict[str, bool] | None = None) -> None:
        super().__init__(Path("/nonexistent"))
        self._ports = ports or {}

    def serial_ports(self) -> dict[str, bool]:
        return self._ports


def inquiry(
    drivers: list[Driver] | None = None, *, seconds: float = 20.0, owner: Any = None, say: Any = None
) -> Inquiry:
    known = KnownInstruments(OURS if drivers is None else drivers)
    return Inquiry(SystemClock(), seconds, known, owner or Unowned(), say or (lambda _: None))


def looked(request: ScanRequest, *, say: Any = None, computer: Computer | None = None) -> ScanReport:
    return scan(
        request,
        OURS,
        clock=SystemClock(),
        owner=Unowned(),
        visa=StationVisa("@py"),
        computer=computer or Nowhere(),
        say=say or (lambda _: None),
    )


@contextmanager
def listening(answer: Callable[[socket.socket], None]) -> Iterator[int]:
    """A socket on which each who connects is served by `answer`; gives its port."""
    with socket.create_server(("127.0.0.1", 0)) as server:

        def serve() -> None:
            while True:
                try:
                    line, _ = server.accept()
                except OSError:
                    return
                with line, suppress(OSError):
                    answer(line)

        thread = threading.Thread(target=serve, daemon=True)
        thread.start()
        yield server.getsockname()[1]
        with suppress(OSError):
            server.shutdown(socket.SHUT_RDWR)
    thread.join()


def answering(data: bytes, *, late: float = 0.0) -> Callable[[socket.socket], None]:
    def answer(line: socket.socket) -> None:
        assert line.recv(100) == b"*IDN?\n"
        time.sleep(late)  # noqa: TID251  a slow instrument
        line.sendall(data)
        line.recv(100)

    return answer


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


@contextmanager
def terminal() -> Iterator[tuple[int, str]]:
    """A pseudo-terminal: its master's descriptor, and the path of its port."""
    master, slave = pty.openpty()
    tty.setraw(slave)
    try:
        yield master, os.ttyname(slave)
    finally:
        os.close(master)
        os.close(slave)


@contextmanager
def talking(master: int, data: bytes) -> Iterator[None]:
    """What is behind the port sends, again and again, while the block lasts."""
    done = threading.Event()

    def talk() -> None:
        while not done.wait(0.02):
            os.write(master, data)

    thread = threading.Thread(target=talk)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()


def written(master: int) -> bytes:
    os.set_blocking(master, False)
    try:
        return os.read(master, 1000)
    except BlockingIOError:
        return b""


def test_nothing_is_written_on_a_port_that_nobody_named() -> None:
    with terminal() as (master, port):
        report = looked(ScanRequest(named_only=True), computer=Nowhere({port: True, "/dev/ttyNO": False}))
        assert written(master) == b""
    why = {one.where: str(one.why) for one in report.unlooked}
    assert f"--serial {port}" in why[port]
    assert "add yourself to its group" in why["/dev/ttyNO"]
    assert report.asked == []


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


def test_a_port_that_talks_is_listened_to_and_not_written_to() -> None:
    with terminal() as (master, port):
        asked = inquiry()
        with talking(master, b"12345\r\x0241220000012345\r\x0241220000001"):
            serial_lines.ask_port(asked, port)
        assert written(master) == b""
    (found,) = asked.report.found
    assert found.matches, str(found.said)
    assert found.matches[0].driver.name == "lutron-tachometer"
    assert str(found.said) == "a Lutron frame: 12345, annunciator 22"


def test_a_port_that_talks_as_nobody_knows_is_shown() -> None:
    quick = [Driver("talker", Role.TACHOMETER, object, "", recognised_by=(SerialTalk(9600, lambda _: None, wait=0.2),))]
    with terminal() as (master, port):
        asked = inquiry(quick)
        with talking(master, b"$GPGGA,1\r\n"):
            serial_lines.ask_port(asked, port)
    (found,) = asked.report.found
    assert found.matches == ()
    assert "$GPGGA,1" in str(found.said)


@dataclass(frozen=True)
class RatedOptions:
    """What a station file may say of an invented supply."""

    baud_rate: int = 57_600
    serial_number: str | None = None


def firmware(heard: bytes) -> Text | None:
    """A VESC's COMM_FW_VERSION: 02, length, 00, major, minor …"""
    return (
        text("firmware {major}.{minor}", major=heard[3], minor=heard[4])
        if heard[:1] == b"\2" and len(heard) > 5
        else None
    )


def test_a_named_port_is_asked_what_a_plug_in_s_driver_declares() -> None:
    ask = SerialTalk(115_200, firmware, VESC_QUESTION, wait=2.0)
    vesc = Driver("vesc", Role.INVERTER, RatedOptions, "", recognised_by=(ask,))
    with terminal() as (master, port):

        def answer() -> None:
            assert os.read(master, 100) == VESC_QUESTION
            os.write(master, bytes.fromhex("02 05 00 06 05 41 00 12 34 03"))

        vesc_thread = threading.Thread(target=answer)
        vesc_thread.start()
        asked = inquiry([vesc])
        serial_lines.ask_port(asked, port)
        vesc_thread.join()
    (found,) = asked.report.found
    assert (found.matches[0].driver.name, str(found.said)) == ("vesc", "firmware 6.5")


def test_a_named_port_is_asked_idn_at_the_rate_of_a_driver_that_speaks_scpi_there() -> None:
    tester = [driver for driver in OURS if driver.name == "gwinstek-gpt9800"]
    with terminal() as (master, port):

        def answer() -> None:
            assert os.read(master, 100) == b"*IDN?\r\n"
            os.write(master, b"GPT-9804 ,EM123,v2.08,\r\n")

        thread = threading.Thread(target=answer)
        thread.start()
        asked = inquiry(tester)
        serial_lines.ask_port(asked, port)
        thread.join()
    (found,) = asked.report.found
    assert (found.address, found.matches[0].options) == (f"ASRL{port}::INSTR", {"baud_rate": 115_200})


def test_an_empty_line_is_swept_within_the_time_said_before_by_reading_alone() -> None:
    said: list[str] = []
    with terminal() as (master, port):
        asked = inquiry(say=lambda words: said.append(str(words)))
        modbus_line.sweep(asked, f"rtu://{port}?baudrate=19200", (1, 2))
        frames = written(master)
    assert said == [f"rtu://{port}?baudrate=19200: units 1 to 2 in 1 framings, at most 4 s; only registers are read"]
    # Two requests of function 3, one register from 0000H, and no other byte.
    assert [frames[at : at + 6] for at in range(0, len(frames), 8)] == [
        struct.pack(">BBHH", unit, 3, 0, 1) for unit in (1, 2)
    ]
    assert asked.report.found == []
    assert [one.answered for one in asked.report.asked] == [False]


def test_garbage_on_a_modbus_port_finds_nothing() -> None:
    def answer(line: socket.socket) -> None:
        while line.recv(100):
            line.sendall(b"HTTP/1.1 400 Bad Request\r\n\r\n")

    with listening(answer) as port:
        asked = inquiry()
        modbus_line.sweep(asked, f"tcp://127.0.0.1:{port}", (1,))
    assert asked.report.found == []


def test_a_bus_behind_a_serial_adapter_is_asked_for_every_node_by_uploads_alone() -> None:
    with terminal() as (master, port):
        asked = inquiry()
        can_nodes.ask_bus(asked, f"can://slcan/{port}?bitrate=500000&sleep_after_open=0")
        heard = b""
        while piece := written(master):
            heard += piece
    frames = [line for line in heard.split(b"\r") if line.startswith(b"t")]
    assert frames == [b"t%03X84000100000000000" % (0x600 + node) for node in range(1, 128)]
    (question,) = asked.report.asked
    assert (question.answered, str(question.outcome)) == (False, "no answer")


def test_a_stranger_s_driver_that_fails_holds_nobody_up() -> None:
    def broken(heard: bytes) -> Text | None:
        raise SystemExit(heard)

    talks = [
        Driver("broken", Role.TACHOMETER, object, "", recognised_by=(SerialTalk(9600, broken, wait=0.3),)),
        Driver(
            "other", Role.TACHOMETER, object, "", recognised_by=(SerialTalk(9600, lambda _: text("here"), wait=0.3),)
        ),
    ]
    with terminal() as (master, port):
        asked = inquiry(talks)
        with talking(master, b"12 rpm\r\n"):
            serial_lines.ask_port(asked, port)
    (found,) = asked.report.found
    assert (found.matches[0].driver.name, str(found.said)) == ("other", "here")
    assert "SystemExit" in str(asked.known.faults["broken"])


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
    assert f"✗ supply            {there}  another instrument answers than its driver is for" in out
    assert f"✗ dynamometer       rtu://{silent}?baudrate=9600  does not answer" in out
    assert "oscilloscope" not in out
    assert f"{silent}: a serial port" not in out
