"""Instruments on serial ports: what talks by itself, and on a port that a person named what answers a harmless question."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial

from bench.discovery.findings import DriverMatch, FoundInstrument
from bench.discovery.inquiry import Inquiry, shown
from bench.discovery.scpi import judge
from bench.station.computer import Computer
from drivers.interfaces.text import Text, text
from drivers.recognition import SerialTalk
from drivers.transport.canonical_address import serial_port
from drivers.transport.serial.line_settings import PORT_ERRORS, open_port
from drivers.transport.serial.port_errors import not_opened
from drivers.transport.visa.session import IDENTITY_QUERY

#: How long (s) an answer may take on a serial line, and how much longer a question may take to open and close the port.
ANSWER_TIME, MARGIN = 1.0, 2.0
#: A line that talks without end is cut off here (bytes).
_MOST = 1 << 14
_READ_TIME = 0.05


def list_ports(inquiry: Inquiry, computer: Computer) -> None:
    """Put down the serial ports that are not looked at: opening one moves DTR and RTS, which resets some boards."""
    from serial.tools.list_ports import comports

    known = {port.device: port.description for port in comports()}
    usable = computer.serial_ports()
    for port in sorted({*known, *(name for name in usable if "usbtmc" not in name)}):
        if inquiry.looked_at(serial_port(port)):
            continue
        if not usable.get(port, True):
            inquiry.skip(
                port,
                text("you have no permission to use it; add yourself to its group (often dialout) and log in again"),
            )
            continue
        what = known.get(port, "")
        inquiry.skip(
            port,
            text(
                "a serial port{about}, not opened, because opening it may reset the device. To include it: "
                "--serial {port} or --modbus {port}",
                about=f" ({what})" if what not in ("", "n/a") else "",
                port=port,
            ),
        )


def ask_port(inquiry: Inquiry, port: str, used_by: tuple[str, ...] = ()) -> None:
    """Listen on a port; if nothing arrives, send the queries that drivers declare, then *IDN? at the rates of SCPI drivers.

    A station's own port is listened on only.
    """
    if not inquiry.take(port):
        return
    talking, answer = False, b""
    for driver, talk in inquiry.known.serial_lines():
        if talk.question and (used_by or talking):
            continue
        known = partial(inquiry.known.judged, driver.name, talk.recognise)
        what = text("instruments that send by themselves at {rate} bit/s", rate=talk.baudrate)
        if talk.question:
            what = text("{question} at {rate} bit/s", question=repr(talk.question), rate=talk.baudrate)
        heard = inquiry.ask(port, what, partial(_exchange, inquiry, port, talk, known), talk.wait + MARGIN)
        if heard is None:
            continue
        said = known(heard)
        if said is not None:
            inquiry.add(FoundInstrument((port,), said, matches=(DriverMatch(driver),), used_by=used_by))
            return
        talking, answer = talking or not talk.question, answer or heard
    if not (used_by or talking) and _ask_identity(inquiry, port):
        return
    if answer:
        said = text("something sends data, but in a form that no driver knows: {bytes}", bytes=shown(answer))
        inquiry.add(FoundInstrument((port,), said, used_by=used_by))


def _ask_identity(inquiry: Inquiry, port: str) -> bool:
    for rate in inquiry.known.serial_scpi_rates():
        talk = SerialTalk(rate, _whole_line, f"{IDENTITY_QUERY}\r\n".encode(), ANSWER_TIME)
        what = text("{question} at {rate} bit/s", question=IDENTITY_QUERY, rate=rate)
        heard = inquiry.ask(port, what, partial(_exchange, inquiry, port, talk, _whole_line), ANSWER_TIME + MARGIN)
        if heard is not None:
            found = judge(inquiry, (f"ASRL{port}::INSTR",), heard.decode("latin-1").strip())
            matches = tuple(replace(match, options={"baud_rate": rate}) for match in found.matches)
            inquiry.add(replace(found, matches=matches))
            return True
    return False


def _exchange(inquiry: Inquiry, port: str, talk: SerialTalk, known: Callable[[bytes], Text | None]) -> bytes | None:
    """Return what comes until it is recognised, for the talk's time at most; None where nothing does."""
    try:
        line = open_port(port, talk.baudrate, _READ_TIME)
    except PORT_ERRORS as error:
        raise not_opened(port, port, error) from error
    try:
        line.reset_input_buffer()
        if talk.question:
            line.write(talk.question)
        heard, end = b"", inquiry.clock.now() + talk.wait
        while inquiry.clock.now() < end and len(heard) < _MOST:
            piece: bytes = line.read(max(1, line.in_waiting))
            heard += piece
            if piece and known(heard) is not None:
                break
        return heard or None
    finally:
        line.close()


def _whole_line(heard: bytes) -> Text | None:
    return text("answered") if heard.endswith(b"\n") else None
