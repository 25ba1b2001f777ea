"""What a scan hears and writes on serial ports, Modbus lines and CAN buses, and where it writes nothing."""

import os
import socket
import struct
import threading
from dataclasses import dataclass

from bench.discovery import can_nodes, modbus_line, serial_lines
from bench.discovery.scan import ScanRequest
from drivers.catalogue import Driver
from drivers.interfaces import Role
from drivers.interfaces.text import Text, text
from drivers.recognition import SerialTalk
from tests.bench.discovery.places import (
    OURS,
    Nowhere,
    inquiry,
    listening,
    looked,
    talking,
    terminal,
    written,
)

VESC_QUESTION = bytes.fromhex("02 01 00 00 00 03")


def test_nothing_is_written_on_a_port_that_nobody_named() -> None:
    with terminal() as (master, port):
        report = looked(ScanRequest(named_only=True), computer=Nowhere({port: True, "/dev/ttyNO": False}))
        assert written(master) == b""
    why = {one.where: str(one.why) for one in report.unlooked}
    assert f"--serial {port}" in why[port]
    assert "add yourself to its group" in why["/dev/ttyNO"]
    assert report.asked == []


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
