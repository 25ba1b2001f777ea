"""What clients send to the virtual bench: SCPI messages, Modbus frames, requests to the control endpoint."""

import asyncio
from collections.abc import Iterator
from functools import cache
from typing import Any, cast

from bench.motor.motor_file import load_motor
from sim_instruments.bench import VirtualBench
from sim_instruments.scpi.framing import MessageSplitter
from sim_instruments.server.control.http import JsonService
from sim_instruments.transports.client import Client
from sim_instruments.transports.modbus.frames import HEADER
from tests.studies.fuzz.target import Target

#: The longest message (bytes) that an instrument takes from a socket.
INPUT_BUFFER = 1 << 16


@cache
def _bench() -> VirtualBench:
    return VirtualBench(load_motor("lg-400w").virtual_motor(), sockets=False).__enter__()


def scpi(face: Any, data: bytes) -> None:
    """As a raw socket takes them: whatever comes, the instrument lives on and its error queue stays short."""
    face.clear()
    for message in MessageSplitter(INPUT_BUFFER).feed(data):
        if message is None:
            continue
        face.write(message)
        if face.message_available:
            face.read(1 << 20, 0.0)
    face.clear()
    face.write(b"*CLS;*IDN?")
    assert face.read(200, 1.0)[0].count(b",") == 3


def modbus(data: bytes) -> None:
    stream = _bench().stream("in-process://dynamometer")
    stream.write(data)
    stream.close()
    stream = _bench().stream("in-process://dynamometer")
    stream.write(HEADER.pack(7, 0, 6, 2) + bytes.fromhex("03 0008 0002"))
    assert stream.read(260, 1.0)[:2] == b"\x00\x07"


class Written:
    """Takes what a service writes."""

    def __init__(self) -> None:
        self.content = b""

    def write(self, data: bytes) -> None:
        self.content += data

    async def drain(self) -> None:
        pass

    def get_extra_info(self, _: str) -> None:
        return None


def control(data: bytes) -> None:
    async def serve() -> bytes:
        reader, writer = asyncio.StreamReader(limit=1 << 16), Written()
        reader.feed_data(data)
        reader.feed_eof()
        service: Any = JsonService({"/echo": {"POST": lambda given: given, "GET": lambda _: {}}})
        try:
            await service.serve(Client(reader, cast("asyncio.StreamWriter", writer)))
        except (EOFError, ConnectionError):
            # The client has gone: the server of connections ends this one.
            return writer.content
        return writer.content

    answers = asyncio.run(serve())
    assert b"500 Internal" not in answers


@cache
def targets() -> tuple[Target, ...]:
    """Return the targets of this file."""
    return tuple(_targets())


def _targets() -> Iterator[Target]:
    bench = _bench()
    for name, face, seeds in (
        (
            "supply",
            bench.instrument("supply"),
            (b"VOLT 1,(@1);:CURR 2,(@1);OUTP ON,(@1);MEAS:VOLT? (@1)\n", b"*SRE 32;*OPC?\n"),
        ),
        (
            "bridge",
            bench.instrument("lcr_meter"),
            (b"FREQ 1E3;:FUNC:IMP LSRS;:TRIG:SOUR BUS;*TRG;:FETC?\n", b"APER LONG,2\n"),
        ),
        (
            "oscilloscope",
            bench.instrument("oscilloscope"),
            (b":CHAN1:SCAL 1;:TIM:RANG 1E-3;:WAV:PRE?\n", b":DIG;:WAV:DATA?\n"),
        ),
        ("voltmeter", bench.instrument("voltmeter"), (b"CONF:VOLT:DC 1,1E-6;:READ?\n", b"SENS:VOLT:DC:NPLC 10\n")),
    ):
        run = _scpi_of(face)
        yield Target(f"served-{name}", f"SCPI messages to the virtual {name}", run, (), (*seeds, b"SYST:ERR?\n"))
    frame = HEADER.pack(1, 0, 6, 1) + bytes.fromhex("03 2103 0001")
    write = HEADER.pack(1, 0, 9, 2) + bytes.fromhex("10 0000 0001 02 0000")
    yield Target("served-modbus", "Modbus TCP frames to the virtual dynamometer", modbus, (), (frame, write))
    request = b'POST /echo HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\nContent-Length: 9\r\n\r\n{"a": [1]}'
    yield Target(
        "control-endpoint",
        "HTTP requests to the control endpoint",
        control,
        (),
        (request, b"GET /echo HTTP/1.1\r\n\r\n"),
    )


def _scpi_of(face: Any) -> Any:
    return lambda data: scpi(face, data)
