"""Instruments on serial ports: what talks by itself, and on a port that a person named what answers a harmless question."""

from collections.abc import Iterable

from bench.discovery.findings import DriverMatch, Finding
from bench.discovery.inquiry import Inquiry, shown
from bench.discovery.scpi import judge
from bench.station.computer import Computer
from drivers.interfaces.text import text
from drivers.transport.serial.line_settings import open_port
from drivers.transport.visa.session import IDENTITY_QUERY

#: How long (s) an answer may take on a serial line, and how much longer a question may take to open and close the port.
ANSWER_TIME, MARGIN = 1.0, 2.0
#: A line that talks without end is cut off here (bytes).
_MOST = 1 << 14
_READ_TIME = 0.05


def list_ports(inquiry: Inquiry, computer: Computer, named: Iterable[str]) -> None:
    """Put down the serial ports that are not looked at: opening one moves DTR and RTS, which resets some boards."""
    from serial.tools.list_ports import comports

    known = {port.device: port.description for port in comports()}
    usable = computer.serial_ports()
    for port in sorted({*known, *(name for name in usable if "usbtmc" not in name)} - set(named)):
        if not usable.get(port, True):
            inquiry.skip(port, text("it may not be used; add yourself to its group (often dialout) and log in anew"))
            continue
        what = known.get(port, "")
        inquiry.skip(
            port,
            text(
                "a serial port{about}: opening it may reset what is behind it. Look with --serial {port} or --modbus {port}",
                about=f" ({what})" if what not in ("", "n/a") else "",
                port=port,
            ),
        )


def ask_port(inquiry: Inquiry, port: str, used_by: str = "") -> None:
    """Listen on a port, and where nobody talks ask: what drivers declare, then *IDN? at the rates of those that speak SCPI there."""
    if not inquiry.take(port):
        return
    for driver, talk in inquiry.known.serial_lines():
        if talk.question and used_by:
            continue
        what = (
            text("{question} at {rate} bit/s", question=repr(talk.question), rate=talk.baudrate)
            if talk.question
            else text("who talks by itself at {rate} bit/s", rate=talk.baudrate)
        )
        heard = inquiry.ask(
            port,
            what,
            lambda talk=talk: _exchange(inquiry, port, talk.baudrate, talk.question, talk.wait),
            talk.wait + MARGIN,
        )  # type: ignore[misc]
        if heard is None:
            continue
        said = talk.recognise(heard)
        if said is not None:
            inquiry.add(Finding((port,), said, matches=(DriverMatch(driver),), used_by=used_by))
            return
        if not talk.question:
            inquiry.add(Finding((port,), text("it talks, but not as any driver knows: {bytes}", bytes=shown(heard))))
            return
    if not used_by:
        _ask_identity(inquiry, port)


def _ask_identity(inquiry: Inquiry, port: str) -> None:
    question = f"{IDENTITY_QUERY}\r\n".encode()
    for rate in inquiry.known.serial_scpi_rates():
        what = text("{question} at {rate} bit/s", question=IDENTITY_QUERY, rate=rate)
        heard = inquiry.ask(
            port,
            what,
            lambda rate=rate: _exchange(inquiry, port, rate, question, ANSWER_TIME),
            ANSWER_TIME + MARGIN,  # type: ignore[misc]
        )
        if heard is not None:
            line = heard.decode("latin-1").strip()
            finding = judge(inquiry, (f"ASRL{port}::INSTR",), line)
            inquiry.add(finding)
            return


def _exchange(inquiry: Inquiry, port: str, rate: int, question: bytes, wait: float) -> bytes | None:
    line = open_port(port, rate, _READ_TIME)
    try:
        line.reset_input_buffer()
        if question:
            line.write(question)
        heard, end = b"", inquiry.clock.now() + wait
        while inquiry.clock.now() < end and len(heard) < _MOST:
            piece: bytes = line.read(256)
            if question and heard and not piece:
                break
            heard += piece
        return heard or None
    finally:
        line.close()
